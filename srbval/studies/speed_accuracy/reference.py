"""The converged run of a scene that others are compared with, and how converged it is."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

from srbval.models.health import default_solver
from srbval.models.run_file import scene_content
from srbval.plan.measures import MeasureErrors, Measures, errors_against, plain_or_nulls
from srbval.plan.timing import Measured, measure_all, time_scene
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.storage.stored_result import ContentStore
from srbval.studies.scenes import PAPER_STEP_S, BenchSettings, bench_scene

FINEST, COARSEST = 6, 1  # powers of two below the paper's step
SHARE_OF_CHECK = 1.5  # the run at twice the step costs half as much again


@dataclass(frozen=True, kw_only=True)
class SceneReference:
    """A converged run: its measures, and `own_errors`, how far the run at twice its step is from it.

    Where one of the two failed, `status` and `reason` say so and both are None. `wall_s` is what both took when they
    were computed; `cached`: that was on an earlier occasion.
    """

    scene: str
    solver: str
    dt_s: float
    status: str
    reason: str
    measures: Measures | None
    own_errors: MeasureErrors | None
    wall_s: float
    cached: bool

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON, flat."""
        plain = dict(vars(self))
        measures = plain_or_nulls(plain.pop("measures"), Measures)
        own = plain_or_nulls(plain.pop("own_errors"), MeasureErrors)
        return plain | measures | {f"own_{name}": value for name, value in own.items()}


def reference_store() -> ContentStore:
    """Where references are stored: the user's cache."""
    return ContentStore(kind="reference", computed_by=__name__)


def references(
    scenes: Sequence[str],
    settings: BenchSettings,
    *,
    solver: str | None = None,
    store: ContentStore | None = None,
    progress: Progress = silent,
) -> dict[str, SceneReference]:
    """The reference of each scene: the finest one in the store, else the finest that the time budget allows.

    A reference whose runs failed says so and is not stored.
    """
    solver = solver or default_solver()
    store = store or reference_store()
    found = {name: _stored(name, solver, settings, store) for name in scenes}
    missing = [name for name, reference in found.items() if reference is None]
    pairs = {name: _pair(name, solver, settings) for name in missing}
    runs = {(name, i): scene for name, pair in pairs.items() for i, scene in enumerate(pair)}
    measured = measure_all(runs, task="reference runs", progress=progress) if runs else {}
    for name in missing:
        reference = _reference(name, measured[name, 0], measured[name, 1])
        if reference.measures is not None:
            store.save(scene_content(measured[name, 0].scene), reference.to_dict())
        found[name] = reference
    return {name: reference for name, reference in found.items() if reference is not None}


def _scene(name: str, solver: str, settings: BenchSettings, power: int) -> Scene:
    return bench_scene(
        name, solver=solver, step_s=PAPER_STEP_S / 2**power,
        seconds=settings.accuracy_s, settle_s=settings.accuracy_settle_s,
    )  # fmt: skip


def _stored(name: str, solver: str, settings: BenchSettings, store: ContentStore) -> SceneReference | None:
    for power in range(FINEST, COARSEST - 1, -1):
        found = store.load(scene_content(_scene(name, solver, settings, power)), _from_dict)
        if found is not None:
            return found
    return None


def _pair(name: str, solver: str, settings: BenchSettings) -> tuple[Scene, Scene]:
    """The reference's scene and the one at twice its step, as fine as the time budget allows."""
    trial = time_scene(
        bench_scene(name, solver=solver, seconds=settings.timing_s, settle_s=settings.timing_settle_s), repeats=1
    )
    wall_per_s = trial.timing.best if trial.timing is not None else math.inf
    coarsest_s = wall_per_s * (settings.accuracy_s + settings.accuracy_settle_s) * SHARE_OF_CHECK
    power = math.floor(math.log2(max(1.0, settings.reference_budget_s / coarsest_s)))
    power = min(FINEST, max(COARSEST, power))
    return _scene(name, solver, settings, power), _scene(name, solver, settings, power - 1)


def _reference(name: str, fine: Measured, coarse: Measured) -> SceneReference:
    worse = coarse if fine.measures is not None else fine
    good = fine.measures is not None and coarse.measures is not None
    return SceneReference(
        scene=name,
        solver=fine.scene.solver.name,
        dt_s=fine.scene.solver.step_s,
        status=worse.status,
        reason=worse.reason,
        measures=fine.measures if good else None,
        own_errors=errors_against(coarse.measures, fine.measures) if fine.measures and coarse.measures else None,
        wall_s=fine.wall_s + coarse.wall_s,
        cached=False,
    )


def _from_dict(table: dict[str, Any]) -> SceneReference:
    """A stored reference."""
    measures = {field.name: table[field.name] for field in fields(Measures)}
    measures["harmonics"] = None if table["harmonics"] is None else tuple(table["harmonics"])
    return SceneReference(
        **{name: table[name] for name in ("scene", "solver", "dt_s", "status", "reason", "wall_s")},
        measures=Measures(**measures),
        own_errors=MeasureErrors(**{field.name: table[f"own_{field.name}"] for field in fields(MeasureErrors)}),
        cached=True,
    )
