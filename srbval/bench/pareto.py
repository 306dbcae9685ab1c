"""Which runs nobody beats in both cost and error."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from srbval.bench.row import BenchRun


def non_dominated(points: Sequence[tuple[float, float] | None]) -> list[bool]:
    """For each pair of costs: is there no other that is at most as large in both and smaller in one?

    None stands for a run without such figures: it neither beats nor is on the front.
    """
    present = [p for p in points if p is not None]
    return [p is not None and not any(_beats(other, p) for other in present) for p in points]


def _beats(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] <= other[0] and one[1] <= other[1] and one != other


def with_pareto(rows: Sequence[BenchRun]) -> list[BenchRun]:
    """The rows with their flags set, each scene and model for itself; failed runs are never on a front."""
    flagged = list(rows)
    for group in {(row.scene, row.model) for row in rows}:
        own = [i for i, row in enumerate(rows) if (row.scene, row.model) == group]
        cage = non_dominated([_cost_and_error(rows[i], "cage_error") for i in own])
        band = non_dominated([_cost_and_error(rows[i], "band_rms_error") for i in own])
        for i, best_cage, best_band in zip(own, cage, band, strict=True):
            flagged[i] = replace(rows[i], pareto=best_cage, pareto_band=best_band)
    return flagged


def _cost_and_error(row: BenchRun, error: str) -> tuple[float, float] | None:
    if not row.ok or row.wall_per_simulated_s is None or row.errors is None:
        return None
    return row.wall_per_simulated_s, float(getattr(row.errors, error))
