"""Validation of any model against any rig: the case file, its pairs, and their comparison."""
