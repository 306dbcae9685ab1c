"""Recordings: one `Recording` for a measured file, a simulated run and a stand-in; loaders; registry."""
