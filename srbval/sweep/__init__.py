"""Tables of scenes, run side by side, measured and returned as one frame."""
