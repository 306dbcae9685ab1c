"""How often a run's own word is wrong: drawn scenes, each compared with a converged run of the same scene.

A run is *wrongly ok* if it works without caution and an error is beyond its tolerance by more than chance, *wrongly
failed* if it fails and is like the converged run, which works. Scenes, solvers and steps are drawn from one seed, so
that the sample is the same every time.
"""

import random
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import pytest

from srbval import RunStatus, Scene
from srbval.models.estimates import ERROR_TOLERANCE
from srbval.models.health import CAUTION, SLIDING, default_solver
from srbval.models.simulate import Step
from srbval.models.solvers import SOLVERS
from srbval.models.step_error import block_means, estimate_errors
from srbval.sweep.pool import Attempt, attempt
from srbval.sweep.scenes import PAPER, bench_scene

SCENES = ("play0-outer", "interference-healthy", "interference-inner", "rig-outer", "rig-healthy")
STEPS = (0.5, 1.0, 2.0, 4.0)  # in the paper's step
RPM, LOADS, FRICTION, PLAY_M = (127.0, 6000.0), (0.25, 1.0, 1.0, 2.0), (0.05, 0.5), (0.0, 1e-4)
SECONDS, SETTLE_S = 0.25, 0.1
CONVERGED = 1 / 8  # of the paper's step
CHANCE = 2.0  # standard errors of the comparison of two short runs
RUNS_OF_EACH = 3
SHORT = (3, 39)  # conditions and seed: the first one that draws three scenes, each family, and no kernel of its own
LONG = (99, 11)
# Of 2,070 drawn runs, 0.5 % may be wrong; one of a small sample is the least that a limit can be.
MOST_WRONG = 0.005
SLIDES = (RunStatus.SKIDDING, RunStatus.ROLLERS_UNLOADED, RunStatus.INACCURATE)


def scene_of(name: str, rpm: float, load: float, contact: dict[str, Any], *, solver: str, times: float) -> Scene:
    """A scene at a speed, with `load` times its own and a step of so many of the paper's."""
    step_s = times * PAPER.step_s
    scene = bench_scene(name, solver=solver, step_s=step_s, seconds=SECONDS, settle_s=SETTLE_S, rpm=rpm)
    radial = replace(scene.load, radial_n=load * scene.load.radial_n)
    return replace(scene, contact=replace(scene.contact, **contact), load=radial)


def conditions(count: int, drawn: random.Random) -> Iterator[partial[Scene]]:
    """Drawn scenes, before solver and step are chosen; half of them with their own friction."""
    for _ in range(count):
        friction, name = drawn.uniform(*FRICTION), drawn.choice(SCENES)
        rpm, load = RPM[0] * (RPM[1] / RPM[0]) ** drawn.random(), drawn.choice(LOADS)
        play_m = drawn.uniform(*PLAY_M)
        contact = {"radial_play_m": play_m} if name.startswith("play0") else {}
        if drawn.random() < 0.5:
            contact |= {"static_friction": friction, "dynamic_friction": friction * 5 / 7}
        yield partial(scene_of, name, rpm, load, contact)


def is_off(own: Attempt, right: Attempt) -> bool:
    """True if an error is beyond its tolerance by more than chance; a sliding cage is known to `SLIDING`.

    Errors are those in cage speed, band levels and drive power against the converged run `right`.
    """
    means = [block_means(one.run.scene.output_rate_hz, one.run.out) for one in (own, right) if one.run]
    slides = right.status in SLIDES[:2] and own.status in SLIDES
    limits = ERROR_TOLERANCE | ({"cage": SLIDING} if slides else {})
    return any(abs(e.error) > limits[e.kind] + CHANCE * e.scatter for e in estimate_errors(*means))


@pytest.mark.slow
@pytest.mark.parametrize(("count", "seed"), [SHORT, pytest.param(*LONG, marks=pytest.mark.long_form)])
def test_runs_know_whether_they_are_right(count, seed):
    wrong, words, drawn = list[str](), list[str](), random.Random(seed)
    for condition in conditions(count, drawn):
        right = attempt(condition(solver=default_solver(), times=CONVERGED))
        for _ in range(RUNS_OF_EACH):
            scene = condition(solver=drawn.choice(SOLVERS), times=drawn.choice(STEPS))
            own = attempt(scene, step=Step.CHECKED)
            words.append(own.status)
            ended_early = own.run is None or own.run.samples < own.scene.samples
            if ended_early or not right.measurable:
                continue
            off, sure = is_off(own, right), own.works and CAUTION not in own.reason
            failed = not own.works and own.status != RunStatus.INACCURATE
            if (sure and off) or (failed and not off and right.works):
                wrong.append(f"{condition.args}, {own.scene.solver}: {own.status}, {own.reason}")
    assert len(wrong) <= max(1, MOST_WRONG * len(words)), wrong
    assert {"ok", "inaccurate"} < set(words), "the sample has runs of several kinds"
