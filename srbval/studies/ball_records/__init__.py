"""The study ball records."""
