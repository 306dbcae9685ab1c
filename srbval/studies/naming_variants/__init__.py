"""The study naming variants."""
