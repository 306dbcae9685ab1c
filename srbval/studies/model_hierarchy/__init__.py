"""The study model hierarchy."""
