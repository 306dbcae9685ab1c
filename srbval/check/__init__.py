"""Regression: fresh results compared with the reference results in `reports`, each within its own tolerance."""
