"""``srbval plan``: the simplest model that answers a question about a scene."""

import argparse
import math
import sys
from pathlib import Path
from typing import Any

from srbval.bench.ladder.questions import Question
from srbval.bench.ladder.table import load_calibration
from srbval.cli.arguments import AUTO
from srbval.cli.output import print_json, print_table
from srbval.errors import ConfigurationError
from srbval.plan.coarser_output import Reduction, find_reductions
from srbval.plan.plan import Plan, make_plan
from srbval.scene import Scene, load_scene, paper_scene
from srbval.storage.strict_json import json_object

MET, NOT_MET = 0, 1


def run(options: argparse.Namespace) -> int:
    """Plan and print; exit code 1 where no model, the full one included, keeps the tolerance."""
    scene = scene_of(options)
    plan = make_plan(
        scene,
        question=question_of(options.question),
        tolerance_pct=options.tolerance,
        calibration=load_calibration(Path(options.calibration)) if options.calibration else None,
    )
    found: tuple[Reduction, ...] = ()
    if options.reductions:
        found = find_reductions(scene, question=plan.question, tolerance_pct=plan.tolerance_pct)
    if options.json:
        print_json(json_object(plan) | {"reductions": found})
    else:
        show(plan)
        if found:
            print()
            rows = [(r.name, "yes" if r.taken else "no", r.difference_pct, r.why) for r in found]
            print_table(("reduction of the full model", "taken", "difference [%]", "why"), rows)
    return MET if plan.met else NOT_MET


def show(plan: Plan) -> None:
    """Print the candidates and the choice."""
    rows = [
        (c.model, c.error_pct, c.wall_s, "yes" if c.ok else "no", "<-" if c.model == plan.chosen else "", c.why)
        for c in plan.candidates
    ]
    print_table(("model", "error [%]", "wall [s]", "enough", "", "why"), rows)
    print(f"\nquestion: {plan.question.value}, tolerance {plan.tolerance_pct:g} %: {plan.chosen}")
    if not plan.met:
        print("No model keeps the tolerance, not even the full one: choose a smaller step or a wider tolerance.")
    for reason in plan.outside:
        print(f"outside the calibration: {reason}", file=sys.stderr)


def scene_of(options: argparse.Namespace) -> Scene:
    """The scene named, or the paper's, with the options applied to it; raises what reading it raises."""
    changes = _changes(options)
    return load_scene(options.scene, changes) if options.scene else paper_scene(**changes)


def question_of(name: str) -> Question:
    """The question of that name; `ConfigurationError` for an unknown one."""
    try:
        return Question(name)
    except ValueError:
        raise ConfigurationError(f"question {name!r} is not known. Known: {', '.join(Question)}.") from None


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """The command line's options as a scene table; only what was given."""
    table = {
        "bearing": options.bearing,
        "model": getattr(options, "model", None),  # `plan` has no such option: it chooses the model
        "seed": options.seed,
        "duration_s": options.seconds,
        "shaft_speed_rad_s": options.rpm and options.rpm * 2 * math.pi / 60,
        "defect": {"kind": options.defect, "height_m": _scaled(options.defect_height_mm, 1e-3)},
        "load": {"radial_n": _scaled(options.radial_kn, 1e3), "axial_n": _scaled(options.axial_kn, 1e3)},
        "solver": {"name": options.solver, "step_s": None if options.dt == AUTO else options.dt},
    }
    return _given(table)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _given(table: dict[str, Any]) -> dict[str, Any]:
    filled = {k: _given(v) if isinstance(v, dict) else v for k, v in table.items()}
    return {k: v for k, v in filled.items() if v is not None and v != {}}
