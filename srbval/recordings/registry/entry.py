"""One registered file."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Iterable
from dataclasses import dataclass

from srbval.bearing import Fault
from srbval.recordings.recording import Origin
from srbval.recordings.settings import RecordingSettings


class FileStatus(enum.StrEnum):
    """State of a file compared with what was pinned when it was registered."""

    OK = "ok"
    CHANGED = "changed"
    MISSING = "missing"
    TRUNCATED = "truncated"
    UNREADABLE = "unreadable"


@dataclass(frozen=True, kw_only=True)
class RegisteredRecording:
    """A file of the register. `sha256`, `size_bytes` and `mtime_ns` are those pinned at first use.

    Loads in kN, `fs_hz` in Hz; what the file does not state is None. `reason` explains any status
    but ok, and what an ok file leaves open. `settings` are those the user gave when registering it.
    """

    file: str
    sha256: str
    size_bytes: int
    mtime_ns: int
    status: FileStatus
    reason: str | None = None
    format: str | None = None
    origin: Origin | None = None
    dataset: str | None = None
    state: Fault | None = None
    radial_kn: float | None = None
    axial_kn: float | None = None
    nominal_rpm: float | None = None
    fs_hz: float | None = None
    seconds: float | None = None
    channels: tuple[str, ...] = ()
    channel: str | None = None
    settings: RecordingSettings | None = None

    def with_status(self, status: FileStatus, reason: str | None = None) -> RegisteredRecording:
        """The same file with another status."""
        return dataclasses.replace(self, status=status, reason=reason)


def without_copies(recordings: Iterable[RegisteredRecording]) -> list[RegisteredRecording]:
    """The first of those of `recordings` with the same SHA-256: a copy, or the folder's other name, proves no more.

    Copies with different settings, such as another channel, are different recordings; so are files that could not be
    hashed.
    """
    found: dict[object, RegisteredRecording] = {}
    for recording in recordings:
        found.setdefault((recording.sha256 or recording.file, recording.settings or None), recording)
    return list(found.values())
