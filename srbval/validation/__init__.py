"""Validation of any model against any rig: the case file, its pairs of signals, and their comparison."""
