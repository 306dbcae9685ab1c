"""The study line intervals."""
