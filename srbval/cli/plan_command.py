"""``srbval plan``: the simplest model that answers a question about a scene."""

import argparse
import sys
from pathlib import Path

from srbval.cli.output import print_json, print_table
from srbval.cli.scene_options import scene_of
from srbval.errors import ConfigurationError
from srbval.plan.plan import Plan, make_plan
from srbval.plan.questions import MEANING, Question
from srbval.plan.table import load_calibration
from srbval.storage.json_files import to_json

MET, NOT_MET = 0, 1


def run(options: argparse.Namespace) -> int:
    """Plan and print; exit code 1 where no model, the full one included, keeps the tolerance."""
    plan = make_plan(
        scene_of(options),
        question=question_of(options.question),
        tolerance_pct=options.tolerance,
        calibration=load_calibration(Path(options.calibration)) if options.calibration else None,
    )
    if options.json:
        print_json(to_json(plan))
    else:
        show(plan)
    return MET if plan.met else NOT_MET


def show(plan: Plan) -> None:
    """Print the candidates and the choice."""
    asked = MEANING[plan.question]
    rows = [
        (c.model, None if c.error_pct is None else asked.shown(c.error_pct), c.wall_s, "yes" if c.ok else "no",
         "<-" if c.model == plan.chosen else "", c.why)
        for c in plan.candidates
    ]  # fmt: skip
    print_table(("model", f"error [{asked.unit}]", "wall [s]", "enough", "", "why"), rows)
    print(f"\nquestion: {plan.question.value}, tolerance {plan.tolerance}: {plan.chosen}")
    if not plan.met:
        print("No model keeps the tolerance, not even the full one: choose a smaller step or a wider tolerance.")
    for reason in plan.outside:
        print(f"outside the calibration: {reason}", file=sys.stderr)


def question_of(name: str) -> Question:
    """The question of that name; `ConfigurationError` for an unknown one."""
    try:
        return Question(name)
    except ValueError:
        raise ConfigurationError(f"question {name!r} is not known. Known: {', '.join(Question)}.") from None
