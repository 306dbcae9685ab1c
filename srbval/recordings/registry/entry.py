"""Registered files, their list as the `data` commands report it, and the grids of operating points it covers."""

from __future__ import annotations

import dataclasses
import enum
import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.raw import NO_TABLE, TEXT
from srbval.recordings.recording import Origin
from srbval.recordings.settings import RecordingSettings

SCHEMA_VERSION = 1


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

    Loads in kN, `fs_hz` in Hz, `rpm` the mean shaft speed as far as it is known; what neither the file nor the user
    states is None. `reason` explains any status but ok, and what an ok file leaves open. `settings` are those the user
    gave when registering it.
    `cautions` say what may make its numbers wrong; None where nothing was read or an earlier version looked at it.
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
    rpm: float | None = None
    bearing: str | None = None
    channels: tuple[str, ...] = ()
    channel: str | None = None
    settings: RecordingSettings | None = None
    cautions: tuple[str, ...] | None = None

    def with_status(self, status: FileStatus, reason: str) -> RegisteredRecording:
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


@dataclass(frozen=True)
class GridPoint:
    """One operating point [kN, rpm] of a grid (for the rig: of the paper's Table 5) and its usable files."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    files: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """All points of one data set's grid, and how many of them have no usable file."""

    dataset: str
    points: tuple[GridPoint, ...]
    missing: int


@dataclass(frozen=True, kw_only=True)
class RegisterListing:
    """The register (`unreadable` says why it is not), or the part that a command changed, and the points it covers."""

    manifest: Path
    recordings: tuple[RegisteredRecording, ...]
    coverage: tuple[Coverage, ...] = ()
    unreadable: str = ""

    @property
    def problems(self) -> tuple[RegisteredRecording, ...]:
        """Recordings that are not ok; texts that never were one (a licence, a readme) do not count."""
        wrong = [r for r in self.recordings if r.status is not FileStatus.OK]
        unread = FileStatus.UNREADABLE, TEXT
        return tuple(r for r in wrong if (r.status, r.format) != unread or NO_TABLE not in (r.reason or ""))

    def to_dict(self) -> dict[str, Any]:
        """The JSON document of `srbval data`."""
        return {
            "schema_version": SCHEMA_VERSION,
            "status": "problems" if self.problems else "ok",
            "manifest": str(self.manifest),
            "recordings": self.recordings,
            "coverage": self.coverage,
        }


def coverage_of(recordings: Sequence[RegisteredRecording]) -> tuple[Coverage, ...]:
    """Grids of the data sets that have a registered file; files that are not ok do not cover a point."""
    files: dict[tuple[object, ...], tuple[str, ...]] = {}
    for r in recordings:
        if r.status is FileStatus.OK:
            key = (r.dataset, r.state, r.radial_kn, r.axial_kn, r.nominal_rpm)
            files[key] = (*files.get(key, ()), r.file)
    covered, present = [], {r.dataset for r in recordings}
    for name, grid in ((d.name, d.grid) for d in known_datasets() if d.name in present):
        if grid is not None:
            loads = zip(grid.radial_kn, grid.axial_kn, strict=True)
            places = [(s, *load, rpm) for s, load, rpm in itertools.product(grid.states, loads, grid.nominal_rpm)]
            points = tuple(GridPoint(*place, files.get((name, *place), ())) for place in places)
            covered.append(Coverage(dataset=name, points=points, missing=sum(not p.files for p in points)))
    return tuple(covered)
