"""The study stability."""
