"""The study campaign scale."""
