"""Findings behind a report, gathered before anything is drawn."""
