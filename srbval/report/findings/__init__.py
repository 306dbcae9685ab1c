"""Data on which reports are based, gathered before anything is drawn."""
