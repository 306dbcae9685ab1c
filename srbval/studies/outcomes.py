"""Outcomes of runs that studies compare, stored so that interrupted work continues."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from functools import partial
from typing import TypeVar

import numpy as np

from srbval.models.estimates import TOLERANCE, Estimate
from srbval.models.health import SLIDING
from srbval.models.run import RunStatus
from srbval.models.sensor import band_rms
from srbval.models.simulate import Step, run_content
from srbval.models.step_error import block_means, differences
from srbval.plan.measures import smooth_mean
from srbval.progress import Progress
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import Scene
from srbval.storage.content_store import ContentStore
from srbval.storage.json_files import from_json
from srbval.sweep.pool import Attempt, Ended, run_all

Key = TypeVar("Key")
CHANCE = 2.0  # standard errors of a comparison, its runs being short, by which an error may be beyond its tolerance
MEASURED = ("cage_ratio", "load_share", "band_rms_m_s2", "energy_imbalance")  # of a run: fields of its outcome
STORE = ContentStore(kind="stability", computed_by=__name__)
SLIDING_STATUSES = (RunStatus.SKIDDING.value, RunStatus.ROLLERS_UNLOADED.value)


@dataclass(frozen=True, kw_only=True)
class RunOutcome(Ended):
    """How a run ended by its own checks, and its measures; NaN where there are none.

    `cage_ratio` is weighted as in `plan.measures`; `load_share` the part of the radial load on the rollers;
    `band_rms_m_s2` the ring's vertical acceleration, 500-1500 Hz; `energy_imbalance` as in the run's summary.
    `wall_s` is disturbed by parallel runs; `step_s`: the one that was taken, NaN where none was. `means`: see
    `step_error.block_means`; empty where a run ended early.
    """

    cage_ratio: float
    load_share: float
    band_rms_m_s2: float
    energy_imbalance: float
    seconds: float
    settle_s: float
    wall_s: float
    step_s: float = math.nan
    means: Mapping[str, list[float]] = field(default_factory=dict)

    def errors_against(self, right: "RunOutcome") -> tuple[Estimate, ...]:
        """Errors in cage speed, band levels and drive power against another run of the same scene."""
        own, theirs = ({name: np.array(m) for name, m in outcome.means.items()} for outcome in (self, right))
        return differences(own, theirs)

    def beyond(self, right: "RunOutcome") -> tuple[Estimate, ...]:
        """Those of the errors that are beyond their tolerance by more than chance.

        A cage that slides or rattles is told to a per cent, as a run's own estimate is.
        """
        slides = right.status in SLIDING_STATUSES and self.status in (*SLIDING_STATUSES, RunStatus.INACCURATE.value)
        return tuple(
            e for e in self.errors_against(right)
            if abs(e.error) > (SLIDING if slides and e.kind == "cage" else TOLERANCE[e.kind]) + CHANCE * e.scatter
        )  # fmt: skip


def outcomes(
    scenes: Mapping[Key, Scene], *, task: str, step: Step = Step.UNCHECKED, jobs: int | None, progress: Progress
) -> dict[Key, RunOutcome]:
    """The outcome of every scene: as stored, or run now and stored as soon as the run has ended."""
    content = {key: run_content(scene, step) for key, scene in scenes.items()}
    found = {key: STORE.load(text, partial(from_json, RunOutcome)) for key, text in content.items()}

    def read(key: Key, tried: Attempt, wall_s: float) -> RunOutcome:
        outcome = outcome_of(tried, wall_s)
        STORE.save(content[key], asdict(outcome))
        return outcome

    missing = {key: scene for key, scene in scenes.items() if found[key] is None}
    fresh = run_all(missing, read, task=task, step=step, jobs=jobs, progress=progress) if missing else {}
    return {key: found[key] or fresh[key] for key in scenes}


def outcome_of(tried: Attempt, wall_s: float) -> RunOutcome:
    """What is stored of an attempt."""
    scene, run = tried.scene, tried.run
    measured, means = [math.nan] * len(MEASURED), {}
    if run is not None and run.samples > 0:
        band = band_rms(run.acceleration_m_s2[:, 1], scene.output_rate_hz, SIMULATED_BAND_HZ)
        cage_ratio = smooth_mean(run.cage_rad_s) / scene.mean_shaft_rad_s
        measured = [cage_ratio, run.roller_load_share, band, run.energy_imbalance]
        if run.samples == scene.samples and np.all(np.isfinite(run.acceleration_m_s2)):
            blocks = block_means(scene.output_rate_hz, run.cage_rad_s, run.acceleration_m_s2, run.energy.drive_w)
            means = {name: values.tolist() for name, values in blocks.items()}
    return RunOutcome(
        status=tried.status, reason=tried.reason, **dict(zip(MEASURED, measured, strict=True)),
        seconds=scene.duration_s, settle_s=scene.settle_s, wall_s=wall_s, means=means,
        step_s=math.nan if run is None else run.scene.solver.step_s,
    )  # fmt: skip
