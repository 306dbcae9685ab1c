"""Errors of every model on random scenes near a bundled scene, against the reference model; theory: "Choosing a model".

A row of the results is one model at one random speed, load and defect height, with a run for every kind of defect. The
rollers' diameter leaves the scene's radial play; with the scene `paper` other rows have the printed diameter.
"""

import math
from argparse import Namespace
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import Fault, load_bearing
from srbval.models.hierarchy import MODELS, level_of
from srbval.plan.measured import scene_values
from srbval.plan.plan import refusal
from srbval.plan.questions import MEANING, Question, asked_of, error_pct
from srbval.plan.questions import answer_questions as answers
from srbval.progress import Progress
from srbval.recordings import recording_from_run
from srbval.scene import Scene, load_scene
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.sweep import Case, draws, sweep

TURNS, LEAST_S = 9.0, 0.9  # length of a run, whichever is longer; the pipeline needs eight turns
POINTS = 19  # the largest of 19 errors bounds the next error with a probability of 95 %
RANGES = {"rpm": (353.0, 997.0), "radial_kn": (62.4, 124.8)}  # the rig's speeds but the slowest ones; Table 5
REFERENCE, FINEST = "reference", {"line_contact": {"slices": 21}}  # name of its rows, their setting of `slices`
OF_SCENES = ("base", "fit", "kind")  # columns: what exchangeable scenes have in common
SCENE = (*OF_SCENES, "rpm", "radial_kn", "height_mm")


@dataclass(frozen=True, kw_only=True)
class Base:
    """Bundled scene on which `models` are compared with the model `reference`."""

    reference: str
    models: tuple[str, ...]
    fits: tuple[str, ...] = ("play",)
    kinds: tuple[Fault, ...] = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
    height_mm: tuple[float, float] = (-0.5, -0.5)


BASES = {
    "paper": Base(reference="full", models=MODELS[:-1], fits=("play", "printed"), height_mm=(0.1, 0.2)),
    "rig": Base(reference="slices", models=MODELS),
    "rig-oil": Base(reference="slices", models=MODELS, kinds=(Fault.HEALTHY,)),
}


def cases(points: int, seed: int) -> pd.DataFrame:
    """Table of bundled scenes at random speeds, loads and defect heights, each with the reference model first."""
    rows = []
    for number, (name, fit) in enumerate((name, fit) for name, base in BASES.items() for fit in base.fits):
        base, bearing = BASES[name], load_bearing(load_scene(name).bearing)
        able = [m for m in base.models if refusal(level_of(m), load_scene(name), bearing) is None]
        drawn = draws(RANGES | {"height_mm": base.height_mm}, points, seed=1000 * seed + number)
        drawn = drawn.assign(base=name, fit=fit, point=range(points))
        rows.append(drawn.merge(pd.DataFrame({"model": [REFERENCE, *able]}), how="cross"))
    return pd.concat(rows, ignore_index=True)


def scene_of(case: Case, kind: Fault) -> Scene:
    """Scene of one case with a defect of this kind; the reference model uses half the step of the other models."""
    base, right = BASES[case["base"]], case["model"] == REFERENCE
    step_s = load_scene(case["base"]).solver.step_s
    changes = {
        "model": base.reference if right else case["model"],
        "duration_s": max(60 * TURNS / case["rpm"], LEAST_S),
        "shaft_speed_rad_s": case["rpm"] * 2 * math.pi / 60,
        "load": {"radial_n": case["radial_kn"] * 1e3},
        "contact": {"roller_fit": case["fit"]},
        "defect": {"kind": kind.scene_word, "height_m": case["height_mm"] / 1e3},
        "solver": {"step_s": step_s / 2 if right else step_s},
    }
    return load_scene(case["base"], changes | FINEST if right else changes)


def scenes_of(case: Case) -> tuple[Scene, ...]:
    """Scenes of one case, one for each kind of defect."""
    return tuple(scene_of(case, kind) for kind in BASES[case["base"]].kinds)


def measure(_: Case, *tried: Attempt) -> dict[str, Any]:
    """Read from the successful runs the quantities to compare, by defect, and the median wall time per simulated s."""
    runs = [one.run if one.works else None for one in tried]
    healthy = recording_from_run(runs[0]) if runs[0] is not None else None
    found: dict[str, Any] = {}
    for one, run in zip(tried, runs, strict=True):
        kind, over = one.scene.defect.kind, healthy if one is not tried[0] else None
        if run is not None:
            own = answers(run, load_bearing(one.scene.bearing), over)
            found[kind.scene_word] = {q.value: own[q] for q in asked_of(kind) if own[q] is not None}
    paces = [run.wall_per_simulated_s for run in runs if run is not None]
    return {"answers": found, "pace": float(np.median(paces)) if paces else None}


def errors(table: pd.DataFrame) -> pd.DataFrame:
    """Table of errors [%] by model, scene and ``question`` (a quantity); infinite if only the reference has it."""
    found = []
    for _, of_point in table.groupby(["base", "fit", "point"], sort=False):
        right, *models = of_point.to_dict("records")
        for own in models:
            scene = {name: own[name] for name in (*SCENE, "point", "model") if name != "kind"}
            for kind, known in right["answers"].items():
                given = own["answers"].get(kind, {})
                for question, answer in known.items():
                    error = error_pct(Question(question), given.get(question), answer)
                    found.append({**scene, "kind": kind, "question": question, "error_pct": error})
    return pd.DataFrame(found).fillna({"error_pct": math.inf})


def spread(found: pd.DataFrame, *by: str) -> list[dict[str, Any]]:
    """Summarise errors by the columns `by`: scenes, missing answers, largest error, median error with 95 % interval.

    The interval of the median is between order statistics (Conover, Practical Nonparametric Statistics, 1999).
    """
    rows = []
    for key, of in found.groupby(list(by), sort=False).error_pct:
        size = np.sort(of.to_numpy())
        rank = max(math.floor(size.size / 2 - 0.98 * math.sqrt(size.size)), 1)
        middle = (size[(size.size - 1) // 2] + size[size.size // 2]) / 2
        numbers = (float(one) if np.isfinite(one) else None for one in (size[-1], middle, size[rank - 1], size[-rank]))
        largest, median, *ends = numbers
        row = {"scenes": size.size, "silent": int(np.isinf(size).sum()), "error_pct": largest, "median_pct": median}
        rows.append(dict(zip(by, key, strict=True)) | row | {"ci95_pct": ends})
    return rows


def about(name: str, table: pd.DataFrame) -> dict[str, Any]:
    """Describe the bundled scene `name`: its settings, ranges of speed, load and defect, wall time by model."""
    base, own = BASES[name], table[(table.base == name) & (table.model != REFERENCE)]
    return {
        "reference": base.reference,
        "seconds": 60 * TURNS / RANGES["rpm"][0],
        "ranges": RANGES | {"height_mm": base.height_mm},
        "models": base.models,
        "pace": own.groupby("model", sort=False).pace.median().dropna().to_dict(),
        "values": scene_values(load_scene(name)),
    }


def summary(found: pd.DataFrame, bases: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Summarise errors by scene, quantity (``question``) and model; ``enough``: the largest is within tolerance."""
    rows = spread(found, "base", "question", "model")
    for row in rows:
        asked, error = MEANING[Question(row["question"])], row["error_pct"]
        enough = error is not None and error <= asked.tolerance_pct
        row["enough"] = None if row["question"] in level_of(row["model"]).lacks else enough
        row["wall_per_simulated_s"] = bases[row["base"]]["pace"].get(row["model"])
    return rows


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Measure the errors of every model on random scenes near each bundled scene."""
    table = sweep(cases(POINTS, 0), scenes_of, measure, task="models", jobs=options.jobs, progress=progress)
    found, bases = errors(table), {name: about(name, table) for name in BASES}
    ladder, bounds = summary(found, bases), spread(found, *OF_SCENES, "model", "question")
    text = pd.DataFrame(ladder).drop(columns="ci95_pct").to_string(index=False, float_format="{:.4g}".format)
    return StudyResult(content={"bases": bases, "ladder": ladder, "bounds": bounds}, text=text, name="model_levels")
