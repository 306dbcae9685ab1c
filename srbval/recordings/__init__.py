"""Measured and simulated recordings: the type `Recording`, loaders for files, and the register of files.

Other packages import the names in `__init__.py` from here, and any other name from its module.
"""

from srbval.recordings.load import load_recording, recording_from_run
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSignal, SpeedSource
from srbval.recordings.settings import RecordingSettings
