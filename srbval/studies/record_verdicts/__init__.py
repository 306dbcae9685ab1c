"""The study record verdicts."""
