"""Validation: analyse a recording, compare the model with the paper and the rig, with uncertainty and verdict."""
