"""Measured and simulated recordings: the type `Recording`, loaders for files, and the register of files.

Other packages import the names below from `srbval.recordings`, any other name from the module that defines it.
"""

from srbval.recordings.load import load_recording, recording_from_run
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSignal, SpeedSource
from srbval.recordings.settings import RecordingSettings
