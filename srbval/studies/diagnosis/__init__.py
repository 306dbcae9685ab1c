"""The study diagnosis."""
