"""The study placebo."""
