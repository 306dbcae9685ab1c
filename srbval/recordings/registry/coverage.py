"""Which operating points of a known grid the registered files cover."""

from __future__ import annotations

from collections.abc import Sequence

from srbval.recordings.datasets.description import DatasetDescription, Grid, known_datasets
from srbval.recordings.registry.coverage_point import Coverage, GridPoint
from srbval.recordings.registry.entry import RegisteredRecording, Status

__all__ = ["Coverage", "GridPoint", "coverage"]


def coverage(recordings: Sequence[RegisteredRecording]) -> tuple[Coverage, ...]:
    """Grids of the data sets that have a registered file; files that are not ok do not count as there."""
    present = {r.dataset for r in recordings}
    return tuple(
        _coverage(description, description.grid, recordings)
        for description in known_datasets()
        if description.grid is not None and description.name in present
    )


def _coverage(description: DatasetDescription, grid: Grid, recordings: Sequence[RegisteredRecording]) -> Coverage:
    usable = [r for r in recordings if r.dataset == description.name and r.status is Status.OK]
    points = tuple(
        GridPoint(
            state=state,
            radial_kn=radial_kn,
            axial_kn=axial_kn,
            nominal_rpm=rpm,
            files=tuple(r.file for r in usable if _key(r) == (state, radial_kn, axial_kn, rpm)),
        )
        for state in grid.states
        for radial_kn, axial_kn in zip(grid.radial_kn, grid.axial_kn, strict=True)
        for rpm in grid.nominal_rpm
    )
    return Coverage(dataset=description.name, points=points)


def _key(r: RegisteredRecording) -> tuple[object, ...]:
    return (r.state, r.radial_kn, r.axial_kn, r.nominal_rpm)
