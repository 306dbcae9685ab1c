"""The study run verdicts."""
