"""The study waterfall."""
