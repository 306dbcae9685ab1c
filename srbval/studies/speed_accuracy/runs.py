"""Rows of the benchmark: what each run costs, and how far it is from a converged run of its scene.

A row is what is stored of a run, flat: scene, model, solver and step, status and reason, cost, `Measures`, `ERRORS`;
None where there is none. Failed runs keep their rows. `cage_error_bound`: the error in cage speed, not below the
converged run's own, which limits the comparison; `reference_limited`: the error itself is below that.
"""

import math
import time
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, TypeVar

import numpy as np

from srbval.models.health import default_solver
from srbval.models.run import USABLE, RunStatus
from srbval.models.simulate import run_content
from srbval.plan.measures import Measures, measure
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.storage.content_store import ContentStore
from srbval.studies.scenes import PAPER_STEP_S, bench_scene
from srbval.sweep.pool import Attempt, attempt, right_hand_sides_per_step, run_all

STORE = ContentStore(kind="reference", computed_by=__name__)
WARM_UP_S = 0.002
MEASURES = tuple(field.name for field in fields(Measures))
ERRORS = ("cage_error", "defect_hz_error", "noise_floor_ratio", "band_rms_error", "harmonic_error")
REFERENCE = ("scene", "solver", "dt_s", "status", "reason", "wall_s", *MEASURES, *(f"own_{name}" for name in ERRORS))
FINEST, COARSEST = 6, 1  # powers of two below the paper's step, of a converged run
SHARE_OF_CHECK = 1.5  # the run at twice the step costs half as much again
WALL = "wall_per_simulated_s"
Key = TypeVar("Key", bound=Hashable)
Row = dict[str, Any]


@dataclass(frozen=True, kw_only=True)
class BenchSettings:
    """Durations in simulated seconds, and how often things are repeated.

    `timing_s` of each timed run, after `timing_settle_s`; `accuracy_s` of each run that is compared with the converged
    one, after `accuracy_settle_s`; `reference_budget_s` wall time that one converged run may take; `steps` step sizes,
    as divisors of a second.
    """

    timing_s: float
    timing_settle_s: float
    repeats: int
    accuracy_s: float
    accuracy_settle_s: float
    reference_budget_s: float
    steps: tuple[int, ...]

    def timed(self, name: str, solver: str, step_s: float = PAPER_STEP_S) -> Scene:
        """A scene to be timed: as many steps whatever the step, for those shorter than the paper's."""
        fewer = min(1.0, step_s / PAPER_STEP_S)
        seconds, settle_s = self.timing_s * fewer, self.timing_settle_s * fewer
        return bench_scene(name, solver=solver, step_s=step_s, seconds=seconds, settle_s=settle_s)

    def compared(self, name: str, solver: str, step_s: float) -> Scene:
        """A scene to be compared."""
        return bench_scene(name, solver=solver, step_s=step_s, seconds=self.accuracy_s, settle_s=self.accuracy_settle_s)


def timed_row(name: str, scene: Scene, repeats: int) -> Row:
    """The row of `scene`, run `repeats` times in this thread, without accuracy; settling counts as simulated time.

    Times are wall seconds per simulated second, best and median, None of a run that ends early; `core_share` is
    processor time over wall time of the best run: well below 1, another process was using the core.
    """
    attempt(replace(scene, duration_s=WARM_UP_S, settle_s=0.0))
    walls, shares = list[float](), list[float]()
    for _ in range(repeats):
        busy, started = time.process_time(), time.perf_counter()
        last = attempt(scene)
        shares.append((time.process_time() - busy) / (time.perf_counter() - started))
        if last.run is None or last.status == RunStatus.NOT_FINITE.value:
            walls = []
            break
        walls.append(last.run.wall_s / (last.run.seconds + scene.settle_s))
    wall, solver, dt_s = min(walls, default=None), scene.solver.name, scene.solver.step_s
    per_step = right_hand_sides_per_step(solver)
    rhs_per_s = None if per_step is None else per_step / dt_s
    cost = {
        WALL: wall, "wall_median_per_simulated_s": float(np.median(walls)) if walls else None,
        "us_per_rhs": 1e6 * wall / rhs_per_s if wall and rhs_per_s else None, "repeats": len(walls) or None,
        "core_share": min(1.0, shares[int(np.argmin(walls))]) if walls else None,
    }  # fmt: skip
    return {
        "scene": name, "model": scene.model, "solver": solver, "dt_s": dt_s, "status": last.status,
        "reason": last.reason, "rhs_per_simulated_s": rhs_per_s, **cost, "cage_error_bound": None,
        "reference_limited": False, "pareto": False, "pareto_band": False, **dict.fromkeys((*ERRORS, *MEASURES)),
    }  # fmt: skip


def measured(scenes: Mapping[Key, Scene], *, task: str, progress: Progress = silent) -> dict[Key, Row]:
    """Status, reason, wall time (disturbed by parallel runs) and measures of all `scenes`."""

    def read(_: Key, tried: Attempt, wall_s: float) -> Row:
        good = tried.measurable and tried.run is not None
        measures = vars(measure(tried.run)) if good and tried.run else dict.fromkeys(MEASURES)
        return {"status": tried.status, "reason": tried.reason, "wall_s": wall_s, **measures}

    return run_all(scenes, read, task=task, progress=progress)


def errors_against(own: Mapping[str, Any], right: Mapping[str, Any]) -> Row:
    """Relative differences of measures without sign, both of one scene and duration; None where a side lacks one.

    `noise_floor_ratio` is one floor over the other; `harmonic_error` the largest difference in height of the defect
    line's harmonics, each over its first.
    """
    ratio = {name: ratio_or_none(own[name], right[name]) for name in MEASURES if name != "harmonics"}
    off = {name: None if value is None else abs(value - 1) for name, value in ratio.items()}
    heights = zip(own["harmonics"] or (), right["harmonics"] or (), strict=False)
    return {
        "cage_error": off["cage_ratio"], "defect_hz_error": off["defect_hz"],
        "noise_floor_ratio": ratio["noise_floor"], "band_rms_error": off["band_rms_m_s2"],
        "harmonic_error": max((abs(a - b) for a, b in heights), default=None),
    }  # fmt: skip


def ratio_or_none(value: float | None, reference: float | None) -> float | None:
    """`value` over `reference`; None where one of them is missing or the reference is zero."""
    return None if value is None or not reference else value / reference


def references(scenes: Sequence[str], settings: BenchSettings, *, progress: Progress = silent) -> dict[str, Row]:
    """The converged run of each scene: the finest one that is stored, else the finest that the time budget allows.

    `own_` errors are those of the run at twice its step; `wall_s` is what both took, `cached`: on an earlier occasion.
    One whose runs failed has neither measures nor errors, says why, and is not stored.
    """
    solver = default_solver()
    found = {name: kept for name in scenes if (kept := _stored(name, solver, settings)) is not None}
    pairs = {name: _pair(name, solver, settings) for name in scenes if name not in found}
    runs = {(name, i): scene for name, pair in pairs.items() for i, scene in enumerate(pair)}
    ended = measured(runs, task="reference runs", progress=progress) if runs else {}
    for name, (scene, _) in pairs.items():
        fine, coarse = ended[name, 0], ended[name, 1]
        worse = coarse if fine["cage_ratio"] is not None else fine
        good = fine["cage_ratio"] is not None and coarse["cage_ratio"] is not None
        own = errors_against(coarse, fine) if good else dict.fromkeys(ERRORS)
        found[name] = {
            "scene": name, "solver": solver, "dt_s": scene.solver.step_s, "status": worse["status"],
            "reason": worse["reason"], "wall_s": fine["wall_s"] + coarse["wall_s"], "cached": False,
            **{key: fine[key] if good else None for key in MEASURES},
            **{f"own_{key}": value for key, value in own.items()},
        }  # fmt: skip
        if good:
            STORE.save(run_content(scene), found[name])
    return {name: found[name] for name in scenes}


def _stored(name: str, solver: str, settings: BenchSettings) -> Row | None:
    for power in range(FINEST, COARSEST - 1, -1):
        content = run_content(settings.compared(name, solver, PAPER_STEP_S / 2**power))
        found = STORE.load(content, lambda table: {key: table[key] for key in REFERENCE} | {"cached": True})
        if found is not None:
            return found
    return None


def _pair(name: str, solver: str, settings: BenchSettings) -> tuple[Scene, Scene]:
    """The scene of the converged run and the one at twice its step, as fine as the time budget allows."""
    wall_per_s = timed_row(name, settings.timed(name, solver), 1)[WALL] or math.inf
    coarsest_s = wall_per_s * (settings.accuracy_s + settings.accuracy_settle_s) * SHARE_OF_CHECK
    power = math.floor(math.log2(max(1.0, settings.reference_budget_s / coarsest_s)))
    power = min(FINEST, max(COARSEST, power))
    fine, coarse = (settings.compared(name, solver, PAPER_STEP_S / 2**n) for n in (power, power - 1))
    return fine, coarse


def with_accuracy(
    rows: Sequence[Row], converged: Mapping[str, Row], settings: BenchSettings, progress: Progress = silent
) -> list[Row]:
    """The timed `rows` with status, measures and errors of a longer run of each, and with Pareto flags."""
    scenes = {i: settings.compared(row["scene"], row["solver"], row["dt_s"]) for i, row in enumerate(rows)}
    longer = measured(scenes, task="runs to compare", progress=progress)
    return with_pareto([compared(row, longer[i], converged[row["scene"]]) for i, row in enumerate(rows)])


def compared(row: Row, run: Row, right: Row) -> Row:
    """One row with what its run measured; without errors where run or converged run failed or they are the same run."""
    same = row["solver"] == right["solver"] and math.isclose(row["dt_s"], right["dt_s"], rel_tol=1e-6)
    errors = dict.fromkeys(ERRORS) if same else errors_against(run, right)
    error, own = errors["cage_error"], right["own_cage_error"]
    measures = {key: value for key, value in run.items() if key != "wall_s"}
    limited = error is not None and own > error
    bound = {"cage_error_bound": own if limited else error, "reference_limited": limited}
    return row | measures | errors | bound


def with_pareto(rows: Sequence[Row]) -> list[Row]:
    """The rows with their flags: no other good run of the scene and model is both cheaper and closer.

    `pareto` in cage speed, `pareto_band` in the band's vibration; failed runs are never on a front.
    """
    flagged = [dict(row) for row in rows]
    for group in {(row["scene"], row["model"]) for row in flagged}:
        own = [row for row in flagged if (row["scene"], row["model"]) == group]
        for flag, error in (("pareto", "cage_error"), ("pareto_band", "band_rms_error")):
            points = [
                None if row["status"] not in USABLE or None in (row[WALL], row[error]) else (row[WALL], row[error])
                for row in own
            ]
            for row, best in zip(own, non_dominated(points), strict=True):
                row[flag] = best
    return flagged


def non_dominated(points: Sequence[tuple[float, float] | None]) -> list[bool]:
    """For each pair of values: is there no other that is at most as large in both and smaller in one?

    None stands for a run without these values: it is not on the front and beats no other.
    """
    present = [p for p in points if p is not None]
    return [
        p is not None and not any(other[0] <= p[0] and other[1] <= p[1] and other != p for other in present)
        for p in points
    ]
