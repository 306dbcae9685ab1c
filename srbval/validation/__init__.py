"""Validation: analyse a recording, hold the model against the paper and the rig, with uncertainty and verdict."""
