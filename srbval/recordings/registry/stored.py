"""Loading with what the user settled when the file was registered."""

from __future__ import annotations

import dataclasses
import os
from pathlib import Path

from srbval.errors import DataError
from srbval.recordings.load import load_recording
from srbval.recordings.recording import Recording
from srbval.recordings.registry.entry import RegisteredRecording
from srbval.recordings.registry.manifest import read_manifest
from srbval.recordings.settings import Settings


def load_entry(entry: RegisteredRecording) -> Recording:
    """A registered recording, read with the settings kept for it; raises what `load_recording` raises."""
    return load_recording(entry.file, **dataclasses.asdict(entry.settings or Settings()))


def load_registered(path: str | Path, settings: Settings | None = None) -> Recording:
    """`load_recording` with `settings`, and those of the register where they say nothing.

    A register that cannot be read counts as empty: it must not hide what the file itself shows.
    """
    chosen = (settings or Settings()).over(_kept(path))
    return load_recording(path, **dataclasses.asdict(chosen))


def _kept(path: str | Path) -> Settings:
    try:
        entry = read_manifest().get(os.path.abspath(path))
    except DataError:
        return Settings()
    return (entry.settings if entry is not None else None) or Settings()
