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


@dataclass(frozen=True)
class GridPoint:
    """One operating point [kN, rpm] of a grid (for the rig: of the paper's Table 5) and its registered files."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    files: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Coverage:
    """All points of one data set's grid."""

    dataset: str
    points: tuple[GridPoint, ...]

    @property
    def missing(self) -> tuple[GridPoint, ...]:
        """Points without a usable file."""
        return tuple(p for p in self.points if not p.files)

    def to_dict(self) -> dict[str, Any]:
        """Its JSON object counts the missing points."""
        return {"dataset": self.dataset, "points": self.points, "missing": len(self.missing)}


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
        return tuple(
            r
            for r in self.recordings
            if r.status is not FileStatus.OK
            and not (r.status is FileStatus.UNREADABLE and r.format == TEXT and NO_TABLE in (r.reason or ""))
        )

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
    files: dict[tuple[object, ...], list[str]] = {}
    for r in recordings:
        if r.status is FileStatus.OK:
            files.setdefault((r.dataset, r.state, r.radial_kn, r.axial_kn, r.nominal_rpm), []).append(r.file)
    covered = []
    for name, grid in ((d.name, d.grid) for d in known_datasets()):
        if grid is not None and name in {r.dataset for r in recordings}:
            loads = zip(grid.radial_kn, grid.axial_kn, strict=True)
            points = [(s, *load, rpm) for s, load, rpm in itertools.product(grid.states, loads, grid.nominal_rpm)]
            found = [(*p, tuple(files.get((name, *p), ()))) for p in points]
            covered.append(Coverage(dataset=name, points=tuple(GridPoint(*point) for point in found)))
    return tuple(covered)
