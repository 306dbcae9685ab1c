"""The study path coverage."""
