"""Figures of the report: functions from plain arrays to a picture and a CSV file of what it shows."""
