"""The same content under several names is one recording."""

from __future__ import annotations

from collections.abc import Iterable

from srbval.recordings.registry.entry import RegisteredRecording


def each_once(recordings: Iterable[RegisteredRecording]) -> list[RegisteredRecording]:
    """The first of those of `recordings` that have the same SHA-256: a copy, or a folder's other name, proves no more.

    Copies that the user settled differently, such as by their channel, are different recordings; so are files that
    could not be hashed.
    """
    found: dict[object, RegisteredRecording] = {}
    for recording in recordings:
        found.setdefault((recording.sha256 or recording.file, recording.settings or None), recording)
    return list(found.values())
