"""How often the runs' own verdicts are wrong: many runs, each compared with a converged one of the same scene.

Half of the conditions are the same every time, half are drawn from a seed that is not.
"""

import itertools
import math
import random
import tempfile
import time
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from srbval.models.health import CAUTION, default_solver
from srbval.models.run import USABLE, RunStatus
from srbval.models.simulate import Step
from srbval.models.solvers import SOLVERS
from srbval.models.step_error import TOLERANCE
from srbval.processes.machine import load_average
from srbval.progress import Progress, silent
from srbval.progress.tables import text_table
from srbval.scene import Scene
from srbval.storage.stored_result import ContentStore
from srbval.studies.harness import Study, StudyResult
from srbval.studies.machine import Machine, calibrate, describe_machine
from srbval.studies.outcomes import RunOutcome, outcome_store, outcomes
from srbval.studies.run_verdicts.similar_bearing import similar
from srbval.studies.scenes import PAPER_STEP_S, RPM, bench_scene

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
SIZES = (0.25, 0.5, 1.5)  # of bearings, in the scene's
QUICK_SHARE = 1 / 40
MOST_FALSE = 0.005  # of the runs that say ok without caution
REFUSED = "refused"
DYNAMIC = 5 / 7  # Table 4: dynamic over static friction


@dataclass(frozen=True, kw_only=True)
class Condition:
    """A scene of the bench at a speed; None: the scene's own value. `load` in the scene's load.

    `size`: of a geometrically similar bearing, in the scene's, with the load, masses and stiffnesses that keep the
    stresses; heights and plays are then this many times what is written here.
    """

    scene: str
    rpm: float
    load: float = 1.0
    friction: float | None = None
    play_m: float | None = None
    height_m: float | None = None
    size: float = 1.0

    def at(self, solver: str, times: float, folder: Path) -> Scene:
        """The scene with a solver and a step of so many of the paper's; bearings of other sizes are in `folder`."""
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
        scene = replace(
            scene, shaft_speed_rad_s=self.rpm * RPM, contact=contact, line_contact=line, defect=defect, load=load
        )
        return scene if self.size == 1 else similar(scene, self.size, folder)


class Case(NamedTuple):
    """A run that is judged: `times` the paper's step."""

    condition: Condition
    solver: str
    times: float
    drawn: bool


@dataclass(frozen=True, kw_only=True)
class JudgedRun:
    """A run with its verdict on itself, and the converged run of the same condition."""

    case: Case
    own: RunOutcome
    right: RunOutcome

    @property
    def off(self) -> bool:
        """Is an error beyond its tolerance, by more than the chance of two short runs?"""
        return bool(self.own.beyond(self.right))

    @property
    def says_ok(self) -> bool:
        """Ok without caution."""
        return self.own.status == RunStatus.OK.value and CAUTION not in self.own.reason

    @property
    def falsely_ok(self) -> bool:
        """Did it call itself ok, without caution, and is off?"""
        return self.says_ok and self.off

    @property
    def right_but_unsure(self) -> bool:
        """Is it within the tolerances, and calls itself inaccurate, or ok with caution?"""
        return not (self.off or self.failed or self.says_ok) and bool(self.own.errors_against(self.right))

    @property
    def failed(self) -> bool:
        """Did it end in a failure of the numerics?"""
        return self.own.status not in (*USABLE, REFUSED)

    @property
    def falsely_failed(self) -> bool:
        """Did it call itself failed although it is like the converged run, which says that it is not?"""
        return self.failed and self.right.ok and bool(self.own.errors_against(self.right)) and not self.off

    def to_dict(self) -> dict[str, Any]:
        """Flat, for JSON: `errors` with their standard errors; the reason of wrong verdicts alone."""
        found = {e.of: [float(f"{x:.4g}") for x in (e.error, e.scatter)] for e in self.own.errors_against(self.right)}
        names = ("says_ok", "off", "failed", "falsely_ok", "falsely_failed")
        wrong = self.falsely_ok or self.falsely_failed
        return vars(self.case.condition) | {name: getattr(self, name) for name in names} | {
            "solver": self.case.solver, "step_s": PAPER_STEP_S * self.case.times, "drawn": self.case.drawn,
            "status": self.own.status, "reason": self.own.reason if wrong else "",
            "reference_status": self.right.status, "errors": found,
        }  # fmt: skip


PARTS: Mapping[str, Callable[[Case], str]] = {  # what runs are counted by
    "scene": lambda case: case.condition.scene,
    "solver": lambda case: case.solver,
    "step over the paper's": lambda case: f"{case.times:g}",
    "speed, rpm": lambda case: _range(case.condition.rpm, (355.0, 1000.0, 2000.0, 6000.0)),
    "load over the scene's": lambda case: f"{case.condition.load:g}",
    "friction coefficient": lambda case: _range(case.condition.friction, (0.1, 1.0)),
    "radial play, um": lambda case: _range(case.condition.play_m and 1e6 * case.condition.play_m, (50.0, 200.0)),
    "height of the defect, mm": lambda case: _given(case.condition.height_m and 1e3 * case.condition.height_m),
    "size over the SKF 22240's": lambda case: f"{case.condition.size:g}",
}


def _given(value: float | None) -> str:
    return "the scene's" if value is None else f"{value:g}"


def _range(value: float | None, ends: Sequence[float]) -> str:
    return _given(None) if value is None else f"to {next(end for end in ends if value <= end):g}"


@dataclass(frozen=True, kw_only=True)
class RunVerdicts:
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
        return _counts(self.runs)

    @property
    def parts(self) -> Iterator[dict[str, Any]]:
        """The same by each of `PARTS` and its values."""
        for name, value_of in PARTS.items():
            by_value: dict[str, list[JudgedRun]] = {}
            for run in self.runs:
                by_value.setdefault(value_of(run.case), []).append(run)
            for value in sorted(by_value, key=_by_number):
                yield {"part": name, "value": value} | _counts(by_value[value])

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        statuses = Counter(run.own.status for run in self.runs)
        return {"machine": self.machine, "seed": self.seed, "counts": self.counts, "statuses": statuses,
                "tolerance": TOLERANCE, "parts": list(self.parts), "runs": self.runs}  # fmt: skip


def _counts(runs: Sequence[JudgedRun]) -> dict[str, int]:
    kinds = ("says_ok", "right_but_unsure", "off", "failed", "falsely_ok", "falsely_failed")
    return {"runs": len(runs)} | {kind: sum(getattr(run, kind) for run in runs) for kind in kinds}


def _by_number(text: str) -> tuple[float, str]:
    """Numbers in their order, after what is none."""
    number = text.removeprefix("to ")
    return (float(number), "") if number.removeprefix("-").replace(".", "").isdigit() else (-math.inf, text)


def fixed_cases() -> Iterator[Case]:
    """The half that is the same every time."""
    for scene, rpm in itertools.product(SCENES, SPEEDS_RPM):
        for solver, times in itertools.product(SOLVERS, STEPS):
            yield Case(Condition(scene=scene, rpm=rpm), solver, times, drawn=False)


def drawn_cases(seed: int) -> Iterator[Case]:
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
            size=drawn.choice(SIZES) if drawn.random() < 0.25 else 1.0,
        )
        for solver, times in drawn.sample(list(itertools.product(SOLVERS, STEPS)), RUNS_OF_DRAWN):
            yield Case(condition, solver, times, drawn=True)


def judge_runs(
    *,
    seed: int | None = None,
    share: float = 1.0,
    store: ContentStore | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> RunVerdicts:
    """Run all conditions, or a `share` of them, and compare; `seed` of the half that is drawn: None for the clock.

    Each run that has ended is in the `store`, so that with its seed interrupted work continues where it was.
    """
    load, calibration, store = load_average(), calibrate(), store or outcome_store()
    seed = int(time.time()) if seed is None else seed
    chosen = random.Random(seed)
    cases = [
        case
        for half in (list(fixed_cases()), list(drawn_cases(seed)))
        for case in chosen.sample(half, max(1, round(share * len(half))))
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        references = {case.condition: case.condition.at(default_solver(), REFERENCE, folder) for case in cases}
        right = outcomes(references, task=CONVERGING, store=store, jobs=jobs, progress=progress)
        runs = {case: case.condition.at(case.solver, case.times, folder) for case in cases}
        own = outcomes(runs, task=JUDGING, store=store, step=Step.CHECKED, jobs=jobs, progress=progress)
    return RunVerdicts(
        machine=describe_machine(calibration, calibrate(), load),
        seed=seed,
        runs=tuple(JudgedRun(case=case, own=own[case], right=right[case.condition]) for case in cases),
    )


def _text(result: RunVerdicts) -> str:
    """The counts, and every run whose verdict is wrong."""
    statuses = Counter(run.own.status for run in result.runs)
    counts = result.counts
    rows = [
        (run.case.condition.scene, f"{run.case.condition.rpm:g}", f"{run.case.condition.load:g}", run.case.solver,
         f"{1 / (PAPER_STEP_S * run.case.times):.0f}", run.own.status, "; ".join(map(str, run.own.beyond(run.right))))
        for run in result.runs
        if run.falsely_ok or run.falsely_failed
    ]  # fmt: skip
    text = (
        f"{', '.join(f'{count} {status}' for status, count in statuses.most_common())}\n\n{counts['runs']} runs, seed "
        f"{result.seed}: {counts['says_ok']} report ok without caution, {counts['falsely_ok']} of them are wrong; "
        f"{counts['falsely_failed']} report failure but agree with the converged run"
    )
    columns = ("scene", "rpm", "load", "solver", "1/dt [Hz]", "status", "beyond tolerance")
    return f"{text}\n{text_table(columns, rows)}" if rows else text


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--quick", action="store_true", help="one run in forty")
    parser.add_argument(
        "--seed", metavar="N", type="seed", help="seed of the half that is drawn (default: from the clock)"
    )


def _run(options: Namespace, progress: Progress) -> StudyResult:
    share = QUICK_SHARE if options.quick else 1.0
    result = judge_runs(seed=options.seed, share=share, jobs=options.jobs, progress=progress)
    name = None if options.quick else "run_verdicts"
    return StudyResult(name=name, content=result, text=_text(result), sound=result.sound)


STUDY = Study(
    question="How often are runs that report ok wrong? 2,090 runs, half of them drawn, against converged ones",
    minutes=26, run=_run, options=_options,
)  # fmt: skip
