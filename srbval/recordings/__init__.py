"""Recordings: the type `Recording`, loaders for files, and the register of files.

Other rooms import the names below from this package and any other name from its module.
"""

from srbval.recordings.load import load_recording, recording_from_run
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSignal, SpeedSource
from srbval.recordings.settings import RecordingSettings
