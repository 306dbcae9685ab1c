"""Comparison of the model with recordings: compared quantities, errors, uncertainties and verdicts."""
