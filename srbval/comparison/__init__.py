"""Comparison of the model with recordings: quantities of both, errors, uncertainties, verdicts."""
