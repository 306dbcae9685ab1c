"""How often the runs' own verdicts are wrong: many runs, each compared with a converged one of the same scene.

Half of the conditions are the same every time, half are drawn from a seed that is not. With ``--random`` scenes of all
models are drawn from far wider ranges, with the step that a run chooses by itself, against an eighth of it.
"""

import itertools
import math
import random
import tempfile
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

from srbval.bearing import load_bearing
from srbval.models.estimates import TOLERANCE
from srbval.models.health import CAUTION, default_solver
from srbval.models.run import USABLE, RunStatus
from srbval.models.simulate import Step
from srbval.models.solvers import METHODS, SOLVERS
from srbval.progress import Progress, silent
from srbval.progress.tables import text_table
from srbval.scene import Scene
from srbval.scene.read import similar_parts
from srbval.studies.harness import StudyResult
from srbval.studies.machine import machine_before
from srbval.studies.outcomes import RunOutcome, outcomes
from srbval.studies.scenes import PAPER_STEP_S, RPM, bench_scene

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
# Of random scenes, of all models: as light, heavy, slow and fast as anyone may try; short, as each is run at an
# eighth of its step as well.
RANDOM_RPM, RANDOM_N, RANDOM_MODELS, RANDOM_SECONDS = (60.0, 8000.0), (20.0, 2e6), ("full", "line", "slices"), 0.25
QUICK_SHARE = 1 / 40
MOST_FALSE = 0.005  # of the runs that say ok without caution
REFUSED = "refused"
OWN = "the scene's"
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
    model: str | None = None
    seconds: float = SECONDS

    def at(self, solver: str, times: float, folder: Path) -> Scene:
        """The scene with a solver and a step of so many of the paper's; bearings of other sizes are in `folder`."""
        scene = bench_scene(
            self.scene, solver=solver, step_s=PAPER_STEP_S * times, seconds=self.seconds, settle_s=SETTLE_S, contact={}
        )
        scene = scene if self.model is None else replace(scene, model=self.model)
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


def similar(scene: Scene, size: float, folder: Path) -> Scene:
    """The scene of a geometrically similar bearing, its file in `folder`, at the same speed; see `similar_parts`."""
    bearing = load_bearing(scene.bearing)
    assert bearing.geometry is not None, "a scene of the bench has a bearing with one"
    path = folder / f"{Path(scene.bearing).stem}-{size:g}.toml"
    if not path.exists():
        lengths = {k: v * size if k.endswith("_m") else v for k, v in asdict(bearing.geometry).items()}
        lines = ['title = "similar"', f'source = "{size:g} times {bearing.title}"', "[geometry]"]
        path.write_text("\n".join(lines + [f"{key} = {value!r}" for key, value in lengths.items()]), encoding="utf-8")
    return replace(similar_parts(scene, size), bearing=str(path))


class Case(NamedTuple):
    """A run that is judged: `times` the paper's step, or with one that it chooses itself, beginning there."""

    condition: Condition
    solver: str
    times: float
    drawn: bool
    chooses: bool = False


def scored(case: Case, own: RunOutcome, right: RunOutcome) -> dict[str, Any]:
    """A run beside the converged one, `right`, flat as it is stored.

    `says_ok`: without caution; `off`: an error is beyond its tolerance by more than the chance of two short runs;
    `failed` by its own word. Wrong are `falsely_ok` and `falsely_failed`: failed, but like the converged run, which is
    not. `right_but_unsure`: within the tolerances, but inaccurate or ok with caution by its own word. `errors` with
    their standard errors; the reason of wrong verdicts alone.
    """
    errors, beyond = own.errors_against(right), own.beyond(right)
    says_ok, off = own.status == RunStatus.OK.value and CAUTION not in own.reason, bool(beyond)
    failed = own.status not in (*USABLE, REFUSED)
    falsely_failed = failed and right.measurable and bool(errors) and not off
    usable = own.works and own.status != RunStatus.INACCURATE.value
    verdict = ("usable, with caution" if CAUTION in own.reason else "usable") if usable else own.status
    return vars(case.condition) | {
        "verdict": "failed" if failed else verdict, "right": bool(errors) and not off,
        "says_ok": says_ok, "off": off, "failed": failed, "falsely_ok": says_ok and off,
        "falsely_failed": falsely_failed,
        "right_but_unsure": not (off or failed or says_ok) and bool(errors), "solver": case.solver,
        "step_s": own.step_s if case.chooses else PAPER_STEP_S * case.times, "drawn": case.drawn, "status": own.status,
        "reason": own.reason if falsely_failed or (says_ok and off) else "", "reference_status": right.status,
        "errors": {e.of: [float(f"{x:.4g}") for x in (e.error, e.scatter)] for e in errors},
        "beyond": "; ".join(map(str, beyond)),
    }  # fmt: skip


PARTS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {  # what runs are counted by
    "verdict": lambda run: str(run["verdict"]),
    "scene": lambda run: str(run["scene"]),
    "solver": lambda run: str(run["solver"]),
    "step over the paper's": lambda run: f"{run['step_s'] / PAPER_STEP_S:g}",
    "speed, rpm": lambda run: _range(run["rpm"], (355.0, 1000.0, 2000.0, 6000.0, 8000.0)),
    "load over the scene's": lambda run: f"{run['load']:.2g}",
    "friction coefficient": lambda run: _range(run["friction"], (0.1, 1.0)),
    "radial play, um": lambda run: _range(run["play_m"] and 1e6 * run["play_m"], (50.0, 200.0)),
    "height of the defect, mm": lambda run: OWN if run["height_m"] is None else f"{1e3 * run['height_m']:g}",
    "size over the SKF 22240's": lambda run: f"{run['size']:g}",
}


def _range(value: float | None, ends: Sequence[float]) -> str:
    return OWN if value is None else f"to {next(end for end in ends if value <= end):g}"


def parts(runs: Sequence[Mapping[str, Any]]) -> Iterator[dict[str, Any]]:
    """The counts by each of `PARTS` and its values."""
    for name, value_of in PARTS.items():
        by_value: dict[str, list[Mapping[str, Any]]] = {}
        for run in runs:
            by_value.setdefault(value_of(run), []).append(run)
        for value in sorted(by_value, key=_by_number):
            yield {"part": name, "value": value} | counts(by_value[value])


def counts(runs: Sequence[Mapping[str, Any]]) -> dict[str, int]:
    """How many runs there are, by what they say and what is wrong with that."""
    kinds = ("right", "says_ok", "right_but_unsure", "off", "failed", "falsely_ok", "falsely_failed")
    return {"runs": len(runs)} | {kind: sum(run[kind] for run in runs) for kind in kinds}


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


def random_cases(seed: int, count: int) -> Iterator[Case]:
    """Scenes from the whole of what may be asked for; implicit solvers mostly choose their step, see the command."""
    drawn = random.Random(f"random {seed}")

    def within(ends: tuple[float, float]) -> float:
        return math.exp(drawn.uniform(*map(math.log, ends)))

    for _ in range(count):
        scene = drawn.choice(SCENES)
        condition = Condition(
            scene=scene, rpm=round(within(RANDOM_RPM)), model=drawn.choice(RANDOM_MODELS), seconds=RANDOM_SECONDS,
            load=within(RANDOM_N) / bench_scene(scene, solver="imex2", seconds=1.0, settle_s=0.0).load.radial_n,
        )  # fmt: skip
        solver = default_solver() if drawn.random() < 0.6 else drawn.choice(SOLVERS)
        chooses = METHODS[solver].implicit and drawn.random() < 0.75
        yield Case(condition, solver, 1.0 if chooses else drawn.choice((0.5, 1.0, 2.0)), drawn=True, chooses=chooses)


def judge_runs(
    *,
    seed: int | None = None,
    share: float = 1.0,
    scenes: int | None = None,
    jobs: int | None = None,
    progress: Progress = silent,
) -> dict[str, Any]:
    """Run all conditions, or a `share` of them, and compare; `seed` of the half that is drawn: None for the clock.

    In their place so many random `scenes`, if that is given. What has chosen its step is compared with an eighth of it.

    Each run that has ended is stored, so that with its seed interrupted work continues where it was.
    """
    machine = machine_before()
    seed = int(time.time()) if seed is None else seed
    chosen = random.Random(seed)
    halves = [list(random_cases(seed, scenes))] if scenes else [list(fixed_cases()), list(drawn_cases(seed))]
    cases = [case for half in halves for case in chosen.sample(half, max(1, round(share * len(half))))]
    own: dict[Case, RunOutcome] = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for step in (Step.CHECKED, Step.AUTO):
            some = {c: c.condition.at(c.solver, c.times, folder) for c in cases if c.chooses is (step is Step.AUTO)}
            own |= outcomes(some, task=f"runs, step {step}", step=step, jobs=jobs, progress=progress)
        times = {
            c: REFERENCE * (own[c].step_s / PAPER_STEP_S if c.chooses and own[c].step_s > 0 else 1.0) for c in cases
        }
        references = {(c.condition, n): c.condition.at(default_solver(), n, folder) for c, n in times.items()}
        right = outcomes(references, task="converged runs", jobs=jobs, progress=progress)
    found = [scored(case, own[case], right[case.condition, times[case]]) for case in cases]
    return {
        "machine": machine(), "seed": seed, "counts": counts(found), "tolerance": TOLERANCE,
        "statuses": Counter(run["status"] for run in found), "parts": list(parts(found)), "runs": found,
    }  # fmt: skip


def _text(result: Mapping[str, Any]) -> str:
    """The counts, and every run whose verdict is wrong."""
    number, rows = result["counts"], [
        (run["scene"], run["model"], f"{run['rpm']:g}", f"{run['load']:.3g}", run["solver"],
         f"{1 / run['step_s']:.0f}", run["status"], run["beyond"])
        for run in result["runs"]
        if run["off" if run["verdict"].startswith("usable") else "right"]
    ]  # fmt: skip
    verdicts = [
        (row["value"], row["right"], row["runs"] - row["right"]) for row in result["parts"] if row["part"] == "verdict"
    ]
    text = (
        f"{', '.join(f'{count} {status}' for status, count in result['statuses'].most_common())}\n\n"
        f"{text_table(('says', 'right', 'off or ended early'), verdicts)}\n\n{number['runs']} "
        f"runs, seed {result['seed']}: {number['says_ok']} report ok without caution, {number['falsely_ok']} of them "
        f"are wrong; {number['falsely_failed']} report failure but agree with the converged run"
    )
    columns = ("scene", "model", "rpm", "load", "solver", "1/dt [Hz]", "status", "beyond tolerance")
    return f"{text}\n{text_table(columns, rows)}" if rows else text


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    share = QUICK_SHARE if options.quick else 1.0
    result = judge_runs(seed=options.seed, share=share, scenes=options.random, jobs=options.jobs, progress=progress)
    name, number = None if options.quick or options.random else "run_verdicts", result["counts"]
    sound = number["falsely_ok"] <= MOST_FALSE * max(1, number["says_ok"]) and number["falsely_failed"] == 0
    return StudyResult(name=name, content=result, text=_text(result), sound=sound)
