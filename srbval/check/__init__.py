"""Regression: fresh results held against the reference results in `reports`, each within its own tolerance."""
