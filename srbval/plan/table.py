"""The scenes that models are calibrated on, a grid about a bundled scene and random ones within it; the table of errors
and costs of every model on them, and its JSON file.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.plan.questions import Answer, Question
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


@dataclass(frozen=True, kw_only=True)
class CalibrationBase:
    """A bundled scene that models are compared on: its `name`; fits, heights and kinds of defects of the grid.

    Right is the model `reference` at a fraction of the scene's step, with the `finest` changes to the scene.
    """

    name: str
    reference: str
    fits: tuple[str, ...]
    height_mm: tuple[float, ...]
    finest: Mapping[str, Any]
    kinds: tuple[Fault, ...] = KINDS

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
    "rig-oil": CalibrationBase(
        name="rig-oil",
        reference="slices",
        fits=FITS[:1],
        height_mm=(-0.5,),
        finest={"line_contact": {"slices": 31}},
        kinds=KINDS[:1],
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
        every = (*found.entries, *found.between)
        if {entry.case.base for entry in every} != {BASES[found.base].name}:
            raise ValueError("scenes of another base")
        if not found.entries or any(entry.levels.keys() != set(found.models) for entry in every):
            raise ValueError("scenes without all models")
        levels = [level for entry in every for level in entry.levels.values()]
        numbers = [x for level in levels for x in (level.wall_per_simulated_s, *level.error_pct.values())]
        if not math.isfinite(sum(filter(None, numbers), found.seconds + found.step_s)):
            raise ValueError("numbers that are none")
        return found
    except (ArithmeticError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise DataError(
            f"{path}: not a calibration table ({error!r}). Measure one: srbval study run model_hierarchy -o {path.name}"
        ) from error


def _entry(table: Mapping[str, Any]) -> Entry:
    case = CalibrationScene(**{field.name: table[field.name] for field in fields(CalibrationScene)})
    known = Fault(case.kind) in KINDS and case.fit in FITS
    if not known or not math.isfinite(case.rpm + case.radial_kn + case.height_mm):
        raise ValueError(f"no scene: {case}")
    levels = {
        model: LevelEntry(**level | {
            "answers": read_answers(level["answers"]),
            "error_pct": {Question(q): e for q, e in level["error_pct"].items()},
        })
        for model, level in table["rungs"].items()
    }  # fmt: skip
    return Entry(case=case, reference=read_answers(table["reference"]), levels=levels)


def read_answers(table: Mapping[str, Any]) -> dict[Question, Answer | None]:
    """The answers that a JSON object holds."""
    return {Question(q): None if a is None else tuple(a) for q, a in table.items()}
