"""The study known records."""
