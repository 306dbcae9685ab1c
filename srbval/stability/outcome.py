"""Outcomes of the runs of the map, stored so that an interrupted map continues; the converged runs among them."""

import math
from dataclasses import asdict, dataclass
from typing import Any

from srbval.bench.measures import smooth_mean
from srbval.bench.reference import reference_solver
from srbval.bench.scenes import scene_content
from srbval.bench.timing import Attempt, run_all
from srbval.models.band_levels import band_rms
from srbval.models.run import USABLE
from srbval.progress import Progress
from srbval.scene import Scene
from srbval.stability.grid import StabilityCase, StabilityGrid, StabilityGroup
from srbval.storage.content_store import ContentStore
from srbval.validation.pipeline import SIMULATED_BAND_HZ

MEASURED = ("cage_ratio", "load_share", "band_rms_m_s2", "energy_imbalance")  # of a run: fields of its outcome


@dataclass(frozen=True, kw_only=True)
class StabilityOutcome:
    """How a run ended by its own checks, and its measures; NaN where there are none.

    `cage_ratio` is weighted as in `bench.measures`; `load_share` the part of the radial load on the rollers;
    `band_rms_m_s2` the ring's vertical acceleration, 500-1500 Hz; `energy_imbalance` as in the run's summary.
    `wall_s` is disturbed by parallel runs.
    """

    status: str
    reason: str
    cage_ratio: float
    load_share: float
    band_rms_m_s2: float
    energy_imbalance: float
    seconds: float
    settle_s: float
    wall_s: float

    @property
    def ok(self) -> bool:
        """Did the run find nothing wrong with itself? A cage or rollers that slip are not wrong."""
        return self.status in USABLE


def outcome_store() -> ContentStore:
    """Where outcomes are stored: the user's cache."""
    return ContentStore(kind="stability", computed_by=__name__)


def outcomes(
    grid: StabilityGrid,
    cases: tuple[StabilityCase, ...],
    *,
    task: str,
    store: ContentStore,
    jobs: int | None,
    progress: Progress,
) -> dict[StabilityCase, StabilityOutcome]:
    """The outcome of every case: from `store`, or run now and stored as soon as the run has ended."""
    scenes = {case: grid.scene(case) for case in cases}
    found = {case: _stored(store, scene) for case, scene in scenes.items()}
    missing = {case: scene for case, scene in scenes.items() if found[case] is None}

    def read(case: StabilityCase, tried: Attempt, wall_s: float) -> StabilityOutcome:
        outcome = outcome_of(tried, wall_s)
        store.save(scene_content(scenes[case]), asdict(outcome))
        return outcome

    fresh = run_all(missing, read, task=task, jobs=jobs, progress=progress) if missing else {}
    return {case: found[case] or fresh[case] for case in cases}


def outcome_of(tried: Attempt, wall_s: float) -> StabilityOutcome:
    """What is stored of an attempt."""
    scene, run = tried.scene, tried.run
    measured = [math.nan] * len(MEASURED)
    if run is not None and run.samples > 0:
        band = band_rms(run.acceleration_m_s2[:, 1], scene.output_rate_hz, SIMULATED_BAND_HZ)
        cage_ratio = smooth_mean(run.cage_rad_s) / scene.mean_shaft_rad_s
        measured = [cage_ratio, run.roller_load_share, band, run.energy_imbalance]
    return StabilityOutcome(
        status=tried.status, reason=tried.reason, **dict(zip(MEASURED, measured, strict=True)),
        seconds=scene.duration_s, settle_s=scene.settle_s, wall_s=wall_s,
    )  # fmt: skip


def _stored(store: ContentStore, scene: Scene) -> StabilityOutcome | None:
    def read(table: dict[str, Any]) -> StabilityOutcome:
        values: dict[str, Any] = {name: math.nan if value is None else value for name, value in table.items()}
        return StabilityOutcome(**values)

    return store.load(scene_content(scene), read)


@dataclass(frozen=True, kw_only=True)
class StabilityReference:
    """A converged run and the one at twice its step; `flagged`: one of the two found something wrong with itself."""

    group: StabilityGroup
    solver: str
    steps_per_s: int
    fine: StabilityOutcome
    coarse: StabilityOutcome

    @property
    def flagged(self) -> bool:
        """False alarm of the run's own detectors, or no reference after all."""
        return not (self.fine.ok and self.coarse.ok)

    @property
    def own_cage_error(self) -> float:
        """How far the cage speed at twice the step is off, relative."""
        return abs(self.coarse.cage_ratio / self.fine.cage_ratio - 1)

    @property
    def own_load_error(self) -> float:
        """How far the rollers' load at twice the step is off, relative."""
        return abs(self.coarse.load_share / self.fine.load_share - 1)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        worse = self.coarse if self.fine.ok else self.fine
        return {
            **vars(self.group),
            "solver": self.solver,
            "dt_s": 1 / self.steps_per_s,
            "status": worse.status,
            "reason": worse.reason,
            **{name: getattr(self.fine, name) for name in MEASURED},
            "own_cage_error": self.own_cage_error,
            "own_load_error": self.own_load_error,
        }


def reference_cases(grid: StabilityGrid) -> dict[StabilityGroup, tuple[StabilityCase, StabilityCase]]:
    """For each part of the map the reference and the run at twice its step."""
    fine = grid.reference_steps_per_s

    def case(group: StabilityGroup, steps: int) -> StabilityCase:
        return StabilityCase(group=group, solver=reference_solver(), steps_per_s=steps)

    return {group: (case(group, fine), case(group, fine // 2)) for group in grid.groups}


def relative(value: float, reference: float) -> float:
    """`value` over `reference`; NaN where one of them is missing."""
    return value / reference if reference and math.isfinite(reference) else math.nan
