"""Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings."""

__version__ = "0.1.0"
