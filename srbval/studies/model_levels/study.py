"""Run every model on scenes drawn about a bundled one, and compare its answers with the reference model's.

A row is one model on one drawn point (speed, load, defect height): its runs without a defect, with one on the outer
and with one on the inner race. Points are drawn from the same ranges for every roller fit, so that the errors of a
model on one question, fit and defect are exchangeable with those of the next scene from these ranges.
"""

import math
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import Fault, load_bearing
from srbval.models.hierarchy import MODELS, level_of
from srbval.plan.measured import Bound, measured_errors, scene_values
from srbval.plan.plan import make_plan, refusal
from srbval.plan.questions import MEANING, Question, answers, asked_of, error_pct
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.recordings import recording_from_run
from srbval.scene import Scene, load_scene, merge
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.sweep import Case, draws, sweep

POINTS = 19  # the largest of 19 errors bounds the next one with a chance of 95 %
RANGES = {"rpm": (353.0, 997.0), "radial_kn": (62.4, 124.8)}  # the rig's speeds but the slowest ones; Table 5
FINER = 2  # times the steps, for the reference
REFERENCE = "reference"  # name of its rows
LEAST_SHARE = 0.9  # of bounds that hold on fresh scenes


@dataclass(frozen=True, kw_only=True)
class Base:
    """A bundled scene: its `reference` model, the measured `models`, length of a run, range of the defect's height.

    The reference's scene has the `finest` changes beside its finer step.
    """

    reference: str
    models: tuple[str, ...]
    seconds: float = 2.0  # eleven turns at the slowest speed
    fits: tuple[str, ...] = ("play",)
    kinds: tuple[Fault, ...] = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
    height_mm: tuple[float, float] = (-0.5, -0.5)
    finest: Mapping[str, Any] = field(default_factory=lambda: {"line_contact": {"slices": 31}})


BASES = {
    "paper": Base(reference="full", models=MODELS[:-1], fits=("play", "printed"), height_mm=(0.1, 0.2), finest={}),
    "rig": Base(reference="slices", models=MODELS),
    "rig-oil": Base(reference="slices", models=MODELS, seconds=1.0, kinds=(Fault.HEALTHY,)),
}


def cases(points: int, seed: int) -> pd.DataFrame:
    """A row for every base, roller fit, drawn point and model that runs the base's scene; the reference comes first."""
    rows = []
    for number, (name, fit) in enumerate((name, fit) for name, base in BASES.items() for fit in base.fits):
        base, bearing = BASES[name], load_bearing(load_scene(name).bearing)
        able = [m for m in base.models if refusal(level_of(m), load_scene(name), bearing) is None]
        drawn = draws(RANGES | {"height_mm": base.height_mm}, points, seed=1000 * seed + number)
        drawn = drawn.assign(base=name, fit=fit, point=range(points))
        rows.append(drawn.merge(pd.DataFrame({"model": [REFERENCE, *able]}), how="cross"))
    return pd.concat(rows, ignore_index=True)


def scene_of(case: Case, kind: Fault) -> Scene:
    """The scene of a row with this defect."""
    base, right = BASES[case["base"]], case["model"] == REFERENCE
    step_s = load_scene(case["base"]).solver.step_s
    changes = {
        "model": base.reference if right else case["model"],
        "duration_s": base.seconds,
        "shaft_speed_rad_s": case["rpm"] * 2 * math.pi / 60,
        "load": {"radial_n": case["radial_kn"] * 1e3},
        "contact": {"roller_fit": case["fit"]},
        "defect": {"kind": kind.scene_word, "height_m": case["height_mm"] / 1e3},
        "solver": {"step_s": step_s / FINER if right else step_s},
    }
    return load_scene(case["base"], merge(changes, base.finest) if right else changes)


def scenes_of(case: Case) -> tuple[Scene, ...]:
    """The scenes of a row, the healthy one first."""
    return tuple(scene_of(case, kind) for kind in BASES[case["base"]].kinds)


def measure(_: Case, *tried: Attempt) -> dict[str, Any]:
    """Answers by defect, and the wall time per simulated second [s/s]; a run that does not work has no answers."""
    runs = [one.run if one.ok else None for one in tried]
    healthy = recording_from_run(runs[0]) if runs[0] is not None else None
    found: dict[str, Any] = {}
    for one, run in zip(tried, runs, strict=True):
        kind, over = one.scene.defect.kind, healthy if one is not tried[0] else None
        if run is not None:
            own = answers(run, load_bearing(one.scene.bearing), over)
            found[kind.scene_word] = {q.value: own[q] for q in asked_of(kind) if own[q] is not None}
    paces = [run.wall_per_simulated_s for run in runs if run is not None]
    return {"answers": found, "pace": float(np.median(paces)) if paces else None}


def errors(table: pd.DataFrame) -> list[dict[str, Any]]:
    """One row for each model on each scene: its errors [%] on the questions that the reference answers."""
    found = []
    for _, of_point in table.groupby(["base", "fit", "point"], sort=False):
        right, *models = of_point.to_dict("records")
        for own in models:
            for kind, known in right["answers"].items():
                given = own["answers"].get(kind, {})
                error = {q: error_pct(Question(q), given.get(q), known[q]) for q in known}
                row = {name: own[name] for name in ("base", "fit", "point", "model", "rpm", "radial_kn", "height_mm")}
                found.append({**row, "kind": kind, "error_pct": {q: _short(e) for q, e in error.items()}})
    return found


def _short(error: float | None) -> float | None:
    """Four digits, rounded up: a bound stays one."""
    if error is None or error == 0:
        return error
    unit = 10.0 ** (math.floor(math.log10(error)) - 3)
    return float(f"{math.ceil(error / unit) * unit:.4g}")


def about(name: str, table: pd.DataFrame) -> dict[str, Any]:
    """Description of the tables about a base, with its scene as it is."""
    base, own = BASES[name], table[(table.base == name) & (table.model != REFERENCE)]
    more = "".join(f", {value} {key}" for change in base.finest.values() for key, value in change.items())
    return {
        "reference": base.reference,
        "reference_text": f"{base.reference} model at 1/{FINER} of the step{more}",
        "seconds": base.seconds,
        "ranges": RANGES | {"height_mm": base.height_mm},
        "models": base.models,
        "pace": own.groupby("model", sort=False).pace.median().dropna().to_dict(),
        "values": scene_values(load_scene(name)),
    }


def summary(content: Mapping[str, Any]) -> list[dict[str, Any]]:
    """One row for each base, question and model: errors over all scenes in the question's unit, and if it is enough.

    A model is enough if its largest error is within the question's usual tolerance; None if it cannot answer at all.
    """
    found = []
    for base, of in content["bases"].items():
        rows = [row for row in content["rows"] if row["base"] == base]
        for question, meaning in MEANING.items():
            for model in of["models"]:
                given = [r["error_pct"][question] for r in rows if r["model"] == model and question in r["error_pct"]]
                if given:
                    bound = Bound(errors=tuple(sorted(math.inf if error is None else error for error in given)))
                    sizes = dict(
                        zip(("median", "low", "high", "worst"), (*bound.median_pct, bound.error_pct), strict=True)
                    )
                    shown = {name: None if one is None else meaning.shown(one) for name, one in sizes.items()}
                    enough = bound.error_pct is not None and bound.error_pct <= meaning.tolerance_pct
                    found.append(
                        {
                            "base": base,
                            "question": question.value,
                            "title": meaning.title,
                            "model": model,
                            "scenes": len(given),
                            "unanswered": bound.silent,
                            "unit": meaning.unit,
                            **shown,
                            "tolerance": meaning.tolerance,
                            "enough": None if question.value in level_of(model).lacks else enough,
                            "wall_per_simulated_s": of["pace"].get(model),
                        }
                    )
    return found


def check_bounds(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """The planner's bound beside the measured error, for each of the `rows` of `errors`, model and question.

    `held` is true if the error is within the bound; only bounds that the planner states are listed.
    """
    found = []
    for row in rows:
        scene = scene_of(row, Fault(row["kind"]))
        for question, error in row["error_pct"].items():
            plan = make_plan(scene, question=Question(question), measured=measured_errors()[row["base"]])
            bound = next(c.error_pct for c in plan.candidates if c.model == row["model"])
            if bound is not None:
                held = error is not None and error <= bound
                one = {name: row[name] for name in ("base", "fit", "kind", "point", "model")}
                found.append({**one, "question": question, "bound_pct": bound, "error_pct": error, "held": held})
    return pd.DataFrame(found)


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    per_point = sum(len(base.fits) * len(base.kinds) for base in BASES.values())
    fresh = options.fresh_scenes and max(round(options.fresh_scenes / per_point), 1)
    points, seed = (fresh, 1 + options.seed) if fresh else (1 if options.quick else POINTS, 0)
    table = sweep(cases(points, seed), scenes_of, measure, task="models", jobs=options.jobs, progress=progress)
    rows = errors(table)
    if fresh:
        checked = check_bounds(rows)
        counts = checked.groupby("base", sort=False).held.agg(["sum", "count"])
        lines = [f"{base}: {held} of {asked} bounds hold" for base, held, asked in counts.itertuples()]
        share = checked.held.mean()
        text = "\n".join([*lines, f"all: {100 * share:.1f} % on {points * per_point} scenes, seed {options.seed}"])
        return StudyResult(content={"checks": checked.to_dict("records")}, text=text, sound=bool(share >= LEAST_SHARE))
    content = {"bases": {name: about(name, table) for name in BASES}, "rows": rows}
    return StudyResult(
        content=content, text=text_rows(summary(content)), name=None if options.quick else "model_levels"
    )
