"""The study rig bands."""
