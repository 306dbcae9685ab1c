"""The study held out."""
