"""A list of registered files as the `data` commands report it, and the grids of operating points that it covers."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.recordings.datasets.description import OperatingGrid, known_datasets
from srbval.recordings.raw import TEXT
from srbval.recordings.registry.entry import FileStatus, RegisteredRecording

SCHEMA_VERSION = 1


@dataclass(frozen=True, kw_only=True)
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
    """The register, or the part of it that a command changed, and the operating points that it covers."""

    manifest: Path
    recordings: tuple[RegisteredRecording, ...]
    coverage: tuple[Coverage, ...] = ()

    @property
    def problems(self) -> tuple[RegisteredRecording, ...]:
        """Recordings that are not ok; texts that never were one (a licence, a readme) do not count."""
        return tuple(
            r
            for r in self.recordings
            if r.status is not FileStatus.OK and not (r.status is FileStatus.UNREADABLE and r.format == TEXT)
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
    present = {r.dataset for r in recordings}
    return tuple(
        Coverage(
            dataset=description.name,
            points=_points(description.grid, [r for r in recordings if r.dataset == description.name]),
        )
        for description in known_datasets()
        if description.grid is not None and description.name in present
    )


def _points(grid: OperatingGrid, recordings: Sequence[RegisteredRecording]) -> tuple[GridPoint, ...]:
    files: dict[tuple[object, ...], list[str]] = {}
    for r in recordings:
        if r.status is FileStatus.OK:
            files.setdefault((r.state, r.radial_kn, r.axial_kn, r.nominal_rpm), []).append(r.file)
    return tuple(
        GridPoint(
            state=state,
            radial_kn=radial_kn,
            axial_kn=axial_kn,
            nominal_rpm=rpm,
            files=tuple(files.get((state, radial_kn, axial_kn, rpm), ())),
        )
        for state in grid.states
        for radial_kn, axial_kn in zip(grid.radial_kn, grid.axial_kn, strict=True)
        for rpm in grid.nominal_rpm
    )
