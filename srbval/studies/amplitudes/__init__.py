"""The study amplitudes."""
