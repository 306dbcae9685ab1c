"""The study noise."""
