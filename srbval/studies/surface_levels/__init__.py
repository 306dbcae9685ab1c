"""The study surface levels."""
