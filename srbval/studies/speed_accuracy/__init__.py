"""The study speed accuracy."""
