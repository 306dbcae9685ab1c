"""Are the runs' own verdicts right? Many runs, each held against a converged one of the same scene.

Half of the conditions are the same every time, half are drawn from a seed that is not.
"""

from __future__ import annotations

import itertools
import math
import random
import time
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bench.machine import Machine, calibrate, describe_machine, load_average
from srbval.bench.reference import reference_solver
from srbval.bench.scenes import PAPER_STEP_S, bench_scene
from srbval.bench.timing import Attempt, run_all
from srbval.models.run import RunStatus
from srbval.models.simulate import Step
from srbval.models.solvers import SOLVERS
from srbval.models.step_error import CAUTION, TOLERANCE, Estimate, difference, samples
from srbval.progress import Progress, silent
from srbval.scene import Scene
from srbval.stability.grid import RPM

CONVERGING, JUDGING = "converged runs", "runs that judge themselves"
SCENES = ("play0-outer", "interference-healthy", "interference-inner", "rig-outer", "rig-healthy")
SPEEDS_RPM = (127.0, 355.0, 859.0, 2000.0, 6000.0)
STEPS = (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)  # times the paper's step
SECONDS, SETTLE_S = 0.5, 0.1
REFERENCE = 1 / 8  # times the paper's step
DRAWN, RUNS_OF_DRAWN = 130, 8  # conditions from the seed, and solvers and steps of each
LOADS = (0.0, 0.05, 0.25, 1.0, 1.0, 2.0, 10.0)  # times the scene's
FRICTION = (0.02, 1.0)  # range of the coefficient
PLAY_M = 200e-6  # at most
HEIGHTS_M = (-5e-4, 5e-5, 2e-4)  # of defects: pits and bumps
CHANCE = 2.0  # standard errors of the comparison itself, 0.5 s long, that an error may be beyond its tolerance
MOST_FALSE = 0.005  # of the runs that say ok without caution
DYNAMIC = 5 / 7  # Table 4: dynamic over static friction
REFUSED = "refused"


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A scene of the bench at a speed; None: the scene's own value. `load` in the scene's load."""

    scene: str
    rpm: float
    load: float = 1.0
    friction: float | None = None
    play_m: float | None = None
    height_m: float | None = None

    def at(self, solver: str, times: float) -> Scene:
        """The scene with a solver and a step of so many of the paper's."""
        scene = bench_scene(
            self.scene, solver=solver, step_s=PAPER_STEP_S * times, seconds=SECONDS, settle_s=SETTLE_S, contact={}
        )
        contact, line, defect = scene.contact, scene.line_contact, scene.defect
        if self.friction is not None:
            contact = replace(contact, static_friction=self.friction, dynamic_friction=self.friction * DYNAMIC)
            line = replace(line, traction_limit=self.friction)
        if self.play_m is not None:
            contact = replace(contact, radial_play_m=self.play_m)
        if self.height_m is not None:
            defect = replace(defect, height_m=self.height_m)
        load = replace(scene.load, radial_n=self.load * scene.load.radial_n)
        return replace(
            scene, shaft_speed_rad_s=self.rpm * RPM, contact=contact, line_contact=line, defect=defect, load=load
        )


@dataclass(frozen=True, kw_only=True)
class JudgedRun:
    """A run with its verdict on itself, and its errors against the converged run; no `errors` where one was refused."""

    condition: Condition
    solver: str
    step_s: float
    drawn: bool
    status: str
    reason: str
    errors: tuple[Estimate, ...]
    reference_status: str

    @property
    def off(self) -> tuple[Estimate, ...]:
        """Errors beyond their tolerance, by more than the chance of two short runs."""
        return tuple(e for e in self.errors if abs(e.error) > TOLERANCE[e.kind] + CHANCE * e.scatter)

    @property
    def falsely_ok(self) -> bool:
        """Did it call itself ok, without caution, and is off?"""
        return self.says_ok and bool(self.off)

    @property
    def says_ok(self) -> bool:
        """Ok without caution."""
        return self.status == RunStatus.OK.value and CAUTION not in self.reason

    @property
    def falsely_failed(self) -> bool:
        """Did it call itself failed although it is like the converged run, which says that it is not?"""
        failed = self.status != REFUSED and not RunStatus(self.status).usable
        return failed and RunStatus(self.reference_status).usable and bool(self.errors) and not self.off

    def to_dict(self) -> dict[str, Any]:
        """Flat, for JSON."""
        errors = {f"error of {e.of}": e.error for e in self.errors} | {
            f"scatter of {e.of}": e.scatter for e in self.errors
        }
        own = ("solver", "step_s", "drawn", "status", "reason", "reference_status", "falsely_ok", "falsely_failed")
        return vars(self.condition) | {name: getattr(self, name) for name in own} | errors


@dataclass(frozen=True, kw_only=True)
class OwnVerdicts:
    """All runs, what they were drawn from, and how often their verdict was wrong."""

    machine: Machine
    seed: int
    runs: tuple[JudgedRun, ...]

    @property
    def sound(self) -> bool:
        """At most so many runs falsely ok, and none falsely failed?"""
        counts = self.counts
        return counts["falsely_ok"] <= MOST_FALSE * max(1, counts["says_ok"]) and counts["falsely_failed"] == 0

    @property
    def counts(self) -> dict[str, int]:
        """How many runs there are, by what they say and what is wrong with that."""
        kinds = ("says_ok", "falsely_ok", "falsely_failed")
        return {"runs": len(self.runs)} | {kind: sum(getattr(run, kind) for run in self.runs) for kind in kinds}

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        statuses = Counter(run.status for run in self.runs)
        return {"machine": self.machine, "seed": self.seed, "counts": self.counts, "statuses": statuses,
                "tolerance": TOLERANCE, "runs": self.runs}  # fmt: skip


def fixed_conditions() -> Iterator[tuple[Condition, str, float]]:
    """The half that is the same every time: condition, solver, step."""
    for scene, rpm in itertools.product(SCENES, SPEEDS_RPM):
        for solver, times in itertools.product(SOLVERS, STEPS):
            yield Condition(scene=scene, rpm=rpm), solver, times


def drawn_conditions(seed: int) -> Iterator[tuple[Condition, str, float]]:
    """The half that is drawn."""
    drawn = random.Random(seed)
    for _ in range(DRAWN):
        friction = math.exp(drawn.uniform(*map(math.log, FRICTION))) if drawn.random() < 0.5 else None
        condition = Condition(
            scene=drawn.choice(SCENES),
            rpm=round(math.exp(drawn.uniform(math.log(SPEEDS_RPM[0]), math.log(SPEEDS_RPM[-1])))),
            load=drawn.choice(LOADS),
            friction=friction,
            play_m=drawn.uniform(0.0, PLAY_M) if drawn.random() < 0.3 else None,
            height_m=drawn.choice(HEIGHTS_M) if drawn.random() < 0.3 else None,
        )
        for solver, times in drawn.sample(list(itertools.product(SOLVERS, STEPS)), RUNS_OF_DRAWN):
            yield condition, solver, times


def judge_own_verdicts(
    *, seed: int | None = None, share: float = 1.0, jobs: int | None = None, progress: Progress = silent
) -> OwnVerdicts:
    """Run all conditions, or a `share` of them, and compare; `seed` of the half that is drawn: None for the clock."""
    load, calibration = load_average(), calibrate()
    seed = int(time.time()) if seed is None else seed
    halves = [(False, list(fixed_conditions())), (True, list(drawn_conditions(seed)))]
    chosen = random.Random(seed)
    runs = {}
    for drawn, cases in halves:
        for condition, solver, times in chosen.sample(cases, max(1, round(share * len(cases)))):
            runs[condition, solver, times, drawn] = condition.at(solver, times)
    references = {case[0]: case[0].at(reference_solver(), REFERENCE) for case in runs}
    converged = run_all(references, lambda _, tried, __: _signals(tried), task=CONVERGING, jobs=jobs, progress=progress)

    def judged(key: tuple[Condition, str, float, bool], tried: Attempt, _: float) -> JudgedRun:
        condition, solver, times, drawn = key
        own, right = _signals(tried)[1], converged[condition][1]
        with np.errstate(all="ignore"):
            errors = tuple(difference(name, own[name], right[name]) for name in own if name in right)
        return JudgedRun(
            condition=condition, solver=solver, step_s=PAPER_STEP_S * times, drawn=drawn, status=tried.status,
            reason=tried.reason, errors=errors, reference_status=converged[condition][0],
        )  # fmt: skip

    found = run_all(runs, judged, task=JUDGING, step=Step.CHECKED, jobs=jobs, progress=progress)
    return OwnVerdicts(machine=describe_machine(calibration, calibrate(), load), seed=seed, runs=tuple(found.values()))


def _signals(tried: Attempt) -> tuple[str, dict[tuple[str, str], FloatArray]]:
    """Status of a run and what it is compared by; nothing of one that ended early."""
    run = tried.run
    if run is None or run.samples < run.scene.samples:
        return tried.status, {}
    return tried.status, samples(
        run.scene.output_rate_hz, cage_rad_s=run.cage_rad_s, acceleration_m_s2=run.acceleration_m_s2,
        drive_w=run.energy.drive_w,
    )  # fmt: skip
