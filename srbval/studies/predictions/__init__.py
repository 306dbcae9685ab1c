"""The study predictions."""
