"""Recordings: one `Recording` for a measured file, a simulated run and a stand-in; loaders; registry."""

from srbval.recordings.load import load_recording
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.recordings.stand_in import write_stand_in

__all__ = [
    "Origin",
    "Recording",
    "ShaftSpeed",
    "SpeedSource",
    "load_recording",
    "write_stand_in",
]
