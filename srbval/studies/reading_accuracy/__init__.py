"""The study reading accuracy."""
