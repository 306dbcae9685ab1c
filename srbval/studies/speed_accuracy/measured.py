"""Runs timed on one core, best and median of several; runs measured in parallel, for accuracy only; their errors."""

import time
from collections.abc import Hashable, Mapping
from dataclasses import asdict, dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from srbval.comparison.runs import Attempt, Ended, attempt, run_all
from srbval.models.run import RunStatus
from srbval.plan.measures import Measures, measure
from srbval.progress import Progress, silent
from srbval.scene import Scene

WARM_UP_S = 0.002
Key = TypeVar("Key", bound=Hashable)


@dataclass(frozen=True, kw_only=True)
class RunTiming:
    """Wall seconds per simulated second, best and median of `repeats`; share of a core that the best run had.

    The share is processor time over wall time: well below 1, another process was using the core.
    """

    best: float
    median: float
    repeats: int
    core_share: float


@dataclass(frozen=True, kw_only=True, eq=False)
class TimedRun(Attempt):
    """A run with its timing, or without where there is none."""

    timing: RunTiming | None = None


def time_scene(scene: Scene, repeats: int) -> TimedRun:
    """Run `scene` `repeats` times in this thread and time it; settling counts as simulated time.

    A run that ends early, its state no longer finite, has no timing.
    """
    attempt(replace(scene, duration_s=WARM_UP_S, settle_s=0.0))
    walls, shares = [], []
    for _ in range(repeats):
        busy, started = time.process_time(), time.perf_counter()
        last = attempt(scene)
        shares.append((time.process_time() - busy) / (time.perf_counter() - started))
        if last.run is None or last.status == RunStatus.NOT_FINITE.value:
            return TimedRun(**vars(last))
        walls.append(last.run.wall_s / (last.run.seconds + scene.settle_s))
    best = int(np.argmin(walls))
    timing = RunTiming(
        best=walls[best], median=float(np.median(walls)), repeats=repeats, core_share=min(1.0, shares[best])
    )
    return TimedRun(**vars(last), timing=timing)


@dataclass(frozen=True, kw_only=True)
class Measured(Ended):
    """How a run ended and, if successful, its measures; `wall_s` is disturbed by the parallel runs [s]."""

    scene: Scene
    measures: Measures | None
    wall_s: float


def measure_all(
    scenes: Mapping[Key, Scene], *, task: str, jobs: int | None = None, progress: Progress = silent
) -> dict[Key, Measured]:
    """Run and measure all `scenes`, `jobs` at a time (default: one per usable core), the most expensive first."""

    def read(_: Key, tried: Attempt, wall_s: float) -> Measured:
        measures = measure(tried.run) if tried.measurable and tried.run is not None else None
        return Measured(scene=tried.scene, status=tried.status, reason=tried.reason, measures=measures, wall_s=wall_s)

    return run_all(scenes, read, task=task, jobs=jobs, progress=progress)


@dataclass(frozen=True, kw_only=True)
class MeasureErrors:
    """Relative differences from a reference, without sign; None where one of the two lacks the quantity.

    `noise_floor_ratio` is the floor over the reference's; `harmonic_error` the largest difference in height of the
    defect line's harmonics, each over its first.
    """

    cage_error: float
    defect_hz_error: float | None
    noise_floor_ratio: float | None
    band_rms_error: float
    harmonic_error: float | None


def errors_against(measures: Measures, reference: Measures) -> MeasureErrors:
    """Errors of `measures`; both from the same scene and duration."""
    own, right = measures.harmonics, reference.harmonics
    defect = ratio_or_none(measures.defect_hz, reference.defect_hz)
    return MeasureErrors(
        cage_error=abs(measures.cage_ratio / reference.cage_ratio - 1),
        defect_hz_error=None if defect is None else abs(defect - 1),
        noise_floor_ratio=ratio_or_none(measures.noise_floor, reference.noise_floor),
        band_rms_error=abs(measures.band_rms_m_s2 / reference.band_rms_m_s2 - 1),
        harmonic_error=max(abs(a - b) for a, b in zip(own, right, strict=True)) if own and right else None,
    )


def plain_or_nulls(part: Any, kind: type[Any]) -> dict[str, Any]:
    """Plain values of `part`, a dataclass `kind`; the names of its fields with None where there is none."""
    return dict.fromkeys(field.name for field in fields(kind)) if part is None else asdict(part)


def ratio_or_none(value: float | None, reference: float | None) -> float | None:
    """`value` over `reference`; None where one of them is missing or the reference is zero."""
    return None if value is None or not reference else value / reference
