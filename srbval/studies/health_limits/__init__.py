"""The study health limits."""
