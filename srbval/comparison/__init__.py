"""Model against record: the same quantities of both, their differences and uncertainties, verdicts."""
