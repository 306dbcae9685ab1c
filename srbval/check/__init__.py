"""Regression check of the program's behaviour."""
