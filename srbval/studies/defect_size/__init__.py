"""The study defect size."""
