"""The scenes that models are calibrated on, a grid about a bundled scene and random ones within it; the table of errors
and costs of every model on them, its JSON file, its summary.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.models.hierarchy import level_of
from srbval.plan.questions import MEANING, Answer, Question
from srbval.scene import Scene, load_scene, merge
from srbval.storage.files import read_limited
from srbval.storage.json_files import parse_json

RPM = (353.0, 710.0, 997.0)  # the rig's range, without its slowest speeds
RADIAL_KN = (62.4, 124.8)  # Table 5
HEIGHT_MM = (0.1, 0.2)
FITS = ("play", "printed")
KINDS = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
SCHEMA_VERSION = 3
MOST_BYTES = 2**26
LEAST_SHARE = 0.9  # of scenes on which a model must be near, as the planner's bounds hold on nine in ten


@dataclass(frozen=True, kw_only=True)
class CalibrationBase:
    """A bundled scene that models are compared on: its `name`, and the grid's fits of the rollers and defects' heights.

    Right is the model `reference` at a fraction of the scene's step, with the `finest` changes to the scene.
    """

    name: str
    reference: str
    fits: tuple[str, ...]
    height_mm: tuple[float, ...]
    finest: Mapping[str, Any]

    @cached_property
    def scene(self) -> Scene:
        """The bundled scene with this base's reference for its model."""
        return load_scene(self.name, {"model": self.reference})

    @property
    def ranges(self) -> tuple[tuple[float, float], ...]:
        """Least and greatest speed [rpm] and load [kN] of the grid, and height [mm] where there are several."""
        heights = ((self.height_mm[0], self.height_mm[-1]),) if len(self.height_mm) > 1 else ()
        return ((RPM[0], RPM[-1]), (RADIAL_KN[0], RADIAL_KN[-1]), *heights)


BASES = {
    "paper": CalibrationBase(name="paper", reference="full", fits=FITS, height_mm=HEIGHT_MM, finest={}),
    "rig": CalibrationBase(
        name="rig", reference="slices", fits=FITS[:1], height_mm=(-0.5,), finest={"line_contact": {"slices": 31}}
    ),
}


@dataclass(frozen=True, kw_only=True, order=True)
class CalibrationScene:
    """A scene in a few values, all others as in the bundled scene `base`. `height_mm` is 0 without a defect."""

    base: str = "paper"
    kind: str
    fit: str
    rpm: float
    radial_kn: float
    height_mm: float

    @property
    def name(self) -> str:
        """A short name."""
        height = "" if Fault(self.kind) is Fault.HEALTHY else f" {self.height_mm:g} mm"
        return f"{self.kind}{height}, {self.fit}, {self.rpm:g} rpm, {self.radial_kn:g} kN"

    def scene(self, model: str, *, seconds: float, finer: int = 1) -> Scene:
        """The scene for a model, with `finer` times as many steps as by default."""
        defect = {} if Fault(self.kind) is Fault.HEALTHY else {"height_m": self.height_mm / 1e3}
        base = BASES[self.base]
        changes = {
            "model": model,
            "duration_s": seconds,
            "shaft_speed_rad_s": self.rpm * 2 * math.pi / 60,
            "load": {"radial_n": self.radial_kn * 1e3},
            "contact": {"roller_fit": self.fit},
            "defect": {"kind": self.kind, **defect},
            "solver": {"step_s": base.scene.solver.step_s / finer},
        }
        return load_scene(self.base, merge(changes, base.finest) if finer > 1 else changes)

    def reference(self, *, seconds: float, finer: int) -> Scene:
        """The same for the base's reference model."""
        return self.scene(BASES[self.base].reference, seconds=seconds, finer=finer)


@dataclass(frozen=True, kw_only=True)
class Answered:
    """A run's answers (None or left out: none) and its cost: the wall time of the solution, as `Run.wall_s`, times the
    share of a core that the process had, so that other work does not count.
    """

    status: str
    wall_per_simulated_s: float | None
    answers: Mapping[Question, Answer | None]


@dataclass(frozen=True, kw_only=True)
class LevelEntry(Answered):
    """A model on a scene, with the errors of its answers [%]; None: no answer."""

    error_pct: Mapping[Question, float | None]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One calibration scene: the reference's answers and every model's."""

    case: CalibrationScene
    reference: Mapping[Question, Answer | None]
    levels: Mapping[str, LevelEntry]

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON, the scene's values flat."""
        return {**vars(self.case), "reference": self.reference, "rungs": self.levels}


@dataclass(frozen=True, kw_only=True, eq=False)
class CalibrationTable:
    """The table; `seconds` recorded in each run; `solver` and `step_s` of the models that have no method of their own.

    `base`: the bundled scene that all others differ from in a few values.

    `entries` are those of the grid; `between`, scenes drawn within it, tell how far errors go beyond the grid's.
    """

    base: str
    reference: str
    solver: str
    step_s: float
    seconds: float
    machine: Mapping[str, Any]
    entries: tuple[Entry, ...]
    between: tuple[Entry, ...]

    @property
    def reference_model(self) -> str:
        """The model that is right, at half its step."""
        return BASES[self.base].reference

    @property
    def models(self) -> tuple[str, ...]:
        """Models in the order of the hierarchy: cheapest first."""
        return tuple(self.entries[0].levels)

    def to_dict(self) -> dict[str, Any]:
        """What is written as JSON."""
        return {"schema_version": SCHEMA_VERSION, **vars(self)}


def load_calibration(path: Path) -> CalibrationTable:
    """Read a table; `DataError` naming the file where it is missing or is none."""
    try:
        table = parse_json(read_limited(path, MOST_BYTES))
        found = CalibrationTable(
            **{name: table[name] for name in ("base", "reference", "solver", "step_s", "seconds", "machine")},
            entries=tuple(_entry(e) for e in table["entries"]),
            between=tuple(_entry(e) for e in table["between"]),
        )
        if {entry.case.base for entry in (*found.entries, *found.between)} != {BASES[found.base].name}:
            raise ValueError("scenes of another base")
        if not (summary(found) and math.isfinite(found.seconds + found.step_s)):  # every number is one
            raise ValueError("no scenes")
        return found
    except (ArithmeticError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise DataError(
            f"{path}: not a calibration table ({error!r}). Measure one: srbval study run model_hierarchy -o {path.name}"
        ) from error


def _entry(table: Mapping[str, Any]) -> Entry:
    case = CalibrationScene(**{field.name: table[field.name] for field in fields(CalibrationScene)})
    if not math.isfinite(case.rpm + case.radial_kn + case.height_mm):
        raise ValueError(f"no scene: {case}")
    return Entry(
        case=case,
        reference=read_answers(table["reference"]),
        levels={
            model: LevelEntry(
                **level
                | {
                    "answers": read_answers(level["answers"]),
                    "error_pct": {Question(q): e for q, e in level["error_pct"].items()},
                }
            )
            for model, level in table["rungs"].items()
        },
    )


def read_answers(table: Mapping[str, Any]) -> dict[Question, Answer | None]:
    """The answers that a JSON object holds."""
    return {Question(q): None if a is None else tuple(a) for q, a in table.items()}


def summary(table: CalibrationTable) -> list[dict[str, Any]]:
    """One row for each question and model: median and worst error over the grid's scenes asked, median cost.

    Scenes on which a model gave no answer are counted, not averaged; without any answer the errors are None. Of an
    amplitude: on how many of all scenes, those between the grid's too, the model is `near`, within its margin, with the
    95 % interval of that share; None where it cannot answer. `least`: the cheapest that is near on `LEAST_SHARE`.
    """
    cost = {model: _median_cost(table, model) for model in table.models}
    rows = [_row(table, question, model, cost) for question in Question for model in table.models]
    enough = [row for row in rows if row["near"] and row["near"] >= LEAST_SHARE * row["near_of"]]
    least = {row["question"]: row["model"] for row in reversed(enough)}
    return [row | {"least": least.get(row["question"]) == row["model"]} for row in rows]


def _row(table: CalibrationTable, question: Question, model: str, cost: dict[str, float | None]) -> dict[str, Any]:
    from scipy.stats import binomtest  # takes a while to load, and plans need no summary

    asked = [e.levels[model] for e in table.entries if question in e.levels[model].error_pct]
    errors = [e for e in (level.error_pct[question] for level in asked) if e is not None]
    own, full, meaning = cost[model], cost.get("full"), MEANING[question]
    median, worst = (float(np.median(errors)), max(errors)) if errors else (None, None)
    near, of = _near(table, question, model)
    return {
        "question": question.value,
        "title": meaning.title,
        "error_of": meaning.error_of,
        "model": model,
        "scenes": len(asked),
        "unanswered": len(asked) - len(errors),
        "median_error_pct": median,
        "worst_error_pct": worst,
        "unit": meaning.unit,
        "median_error": None if median is None else meaning.shown(median),
        "worst_error": None if worst is None else meaning.shown(worst),
        "margin": meaning.margin_pct and meaning.shown(meaning.margin_pct),
        "near": near,
        "near_of": of,
        "near_ci95": None if near is None or not of else tuple(binomtest(near, of).proportion_ci(method="wilson")),
        "wall_per_simulated_s": own,
        "cheaper_than_full": full / own if own and full else None,
    }


def _near(table: CalibrationTable, question: Question, model: str) -> tuple[int | None, int]:
    """On how many scenes a model is within the margin of an amplitude, of those on which the reference shows it."""
    margin = MEANING[question].margin_pct
    if margin is None or question.value in level_of(model).lacks:
        return None, 0
    shown = [e for e in (*table.entries, *table.between) if e.reference.get(question) is not None]
    errors = [e.levels[model].error_pct[question] for e in shown]
    return sum(error is not None and error <= margin for error in errors), len(errors)


def _median_cost(table: CalibrationTable, model: str) -> float | None:
    walls = [e.levels[model].wall_per_simulated_s for e in table.entries]
    known = [wall for wall in walls if wall is not None]
    return float(np.median(known)) if known else None
