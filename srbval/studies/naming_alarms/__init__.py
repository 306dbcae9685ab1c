"""The study naming alarms."""
