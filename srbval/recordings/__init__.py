"""Recordings: one `Recording` for a measured file, a simulated run and a stand-in; loaders; registry."""

from srbval.recordings.load import load_recording
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSource, State

__all__ = ["Origin", "Recording", "ShaftSpeed", "SpeedSource", "State", "load_recording"]
