"""One reduction of a scene, and how it is tried: the same question to two runs, and their times."""

from __future__ import annotations

from dataclasses import asdict, dataclass, replace
from typing import Any

from srbval.bearing import load_bearing
from srbval.bench.ladder.questions import Question, answers, error_pct
from srbval.errors import NumericsError
from srbval.models.run import Run, RunStatus
from srbval.models.simulate import MakeParameters, simulate
from srbval.scene import Scene

SECONDS = 1.0
LEAST_REVOLUTIONS = 10
TIMED_S, REPEATS = 0.1, 3


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """One reduction: is it taken, what it changes in the question's answer [%] where that was tried, and why.

    `saves_pct` of the wall time, or would save, where that was timed.
    """

    name: str
    taken: bool
    difference_pct: float | None
    why: str
    saves_pct: float | None = None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def short_scene(scene: Scene, *, model: str) -> Scene:
    """What a reduction is tried on: a second of the scene, or some revolutions, at its first speed and load."""
    return replace(
        scene, model=model, speed_profile=None, load_profile=None, detail_rate_hz=0.0,
        duration_s=max(SECONDS, LEAST_REVOLUTIONS / scene.shaft_hz),
    )  # fmt: skip


def good(run: Run) -> Run:
    """The run; `NumericsError` where it failed."""
    if run.status is not RunStatus.OK:
        raise NumericsError(f"run failed ({run.status}): {run.reason}.")
    return run


def difference(own: Run, right: Run, question: Question) -> float | None:
    """How far a run's answer is from another's [%]; None where either has none."""
    bearing = load_bearing(right.scene.bearing)
    return error_pct(question, answers(own, bearing).get(question), answers(right, bearing).get(question))


def judged(name: str, difference_pct: float | None, tolerance_pct: float) -> Reduction:
    """Taken where the difference keeps the tolerance."""
    if difference_pct is None:
        return Reduction(name=name, taken=False, difference_pct=None, why="the question has no answer with it")
    kept = difference_pct <= tolerance_pct
    why = f"changes the answer by {difference_pct:.3g} %, {'within' if kept else 'beyond'} {tolerance_pct:.3g} %"
    return Reduction(name=name, taken=kept, difference_pct=difference_pct, why=why)


def saving_pct(scene: Scene, reduced: Scene, *, make: MakeParameters | None = None) -> float:
    """Wall time that `reduced`, or other parameters, save of a short run of `scene` [%]; the best of some each."""
    whole, less = (replace(s, duration_s=TIMED_S, settle_s=0.0) for s in (scene, reduced))
    pairs = [(simulate(whole).wall_s, simulate(less, make=make).wall_s) for _ in range(REPEATS)]
    before, after = (min(walls) for walls in zip(*pairs, strict=True))
    return 100 * (1 - after / before)
