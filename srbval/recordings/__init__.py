"""Recordings: one `Recording` for a measured file, a simulated run and a stand-in; loaders; register.

Other rooms import the names below from here, anything else from its module.
"""

from srbval.recordings.load import load_recording, recording_from_run
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSignal, SpeedSource
from srbval.recordings.settings import RecordingSettings
