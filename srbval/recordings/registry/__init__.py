"""The user's register of recordings: which files there are, what they hold, whether they changed."""

from srbval.recordings.registry.baseline import healthy_baseline
from srbval.recordings.registry.coverage import Coverage, GridPoint, coverage
from srbval.recordings.registry.entry import Listing, RegisteredRecording, Status
from srbval.recordings.registry.fetch import fetch
from srbval.recordings.registry.once import each_once
from srbval.recordings.registry.stored import load_entry, load_registered
from srbval.recordings.registry.verbs import add, find_recording, listing, rig_recordings, verify

__all__ = [
    "Coverage",
    "GridPoint",
    "Listing",
    "RegisteredRecording",
    "Status",
    "add",
    "coverage",
    "each_once",
    "fetch",
    "find_recording",
    "healthy_baseline",
    "listing",
    "load_entry",
    "load_registered",
    "rig_recordings",
    "verify",
]
