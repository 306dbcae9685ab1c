"""Sections of the report: functions that put findings into tables, figures and sentences, without computing."""
