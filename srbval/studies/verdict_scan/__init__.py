"""The study verdict scan."""
