"""Figures of the report: functions that draw arrays as a picture, with the plotted data in a CSV file."""
