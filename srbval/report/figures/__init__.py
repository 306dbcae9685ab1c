"""Figures of the report: functions from plain arrays to a picture and a CSV file with the plotted data."""
