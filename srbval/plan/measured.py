"""Errors of every model about bundled scenes, as the study ``model_levels`` measured them, and where they hold."""

import hashlib
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

from srbval.bearing import Fault, load_bearing
from srbval.errors import DataError
from srbval.models.run_file import scene_dict
from srbval.plan.questions import Question
from srbval.scene import Scene, load_scene
from srbval.storage.stored_result import newest_result

RESULT = "model_levels"
REMEDY = f"srbval study run {RESULT} measures them"
LEAST_SCENES = 9  # for a bound: it then holds on nine scenes in ten
LONGER = 0.6  # of the measured duration, for a run whose errors are no larger
# Axes of the table, and settings that change an answer only through the length of the record.
FREE = {"model", "shaft_speed_rad_s", "duration_s", "settle_s", "output_rate_hz", "detail_rate_hz", "seed"}
FREE |= {"solver.step_s", "load.radial_n", "contact.roller_fit", "defect.kind", "defect.height_m"}
UNMEASURED = {
    "bodies.free_rollers": "rollers that tilt and slide along their axes (bodies.free_rollers) were not measured"
}
WITHOUT = "nothing"  # value of a key that a scene does not have

Key = tuple[str, str, str, Question]  # roller fit, defect, model, question


@dataclass(frozen=True, kw_only=True)
class Bound:
    """Ascending `errors` [%] of one model on one question, one for each drawn scene; infinite without an answer."""

    errors: tuple[float, ...]

    @property
    def error_pct(self) -> float | None:
        """Largest error, the bound of the next scene's; None if the model gave no answer on a scene."""
        return self.errors[-1] if math.isfinite(self.errors[-1]) else None

    @property
    def coverage(self) -> float:
        """Chance, at least, that the bound holds on the next scene drawn from the same ranges: n / (n + 1).

        Split conformal prediction: of n + 1 exchangeable errors each is the largest with the same chance, whatever
        their distribution (Vovk, Gammerman & Shafer 2005; Lei et al. 2018, J. Am. Stat. Assoc. 113, 1094).
        """
        return len(self.errors) / (len(self.errors) + 1)

    @property
    def silent(self) -> int:
        """Number of scenes without an answer."""
        return sum(not math.isfinite(error) for error in self.errors)

    @property
    def median_pct(self) -> tuple[float | None, float | None, float | None]:
        """Median error and its 95 % interval, from order statistics (Conover, Practical Nonparametric Statistics)."""
        count = len(self.errors)
        rank = max(math.floor(count / 2 - 0.98 * math.sqrt(count)), 1)
        middle = (self.errors[(count - 1) // 2] + self.errors[count // 2]) / 2
        low, high = self.errors[rank - 1], self.errors[-rank]
        middle, low, high = (one if math.isfinite(one) else None for one in (middle, low, high))  # type: ignore[assignment]
        return middle, low, high


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredErrors:
    """Errors about the bundled scene `base` against the model `reference` at a finer step, in runs of `seconds`.

    `ranges`: least and greatest value of each axis; `values`: those of the scene as it was measured, by dotted key;
    `pace`: wall time per simulated second of each model [s/s]. `models` are in the order of the hierarchy.
    """

    base: str
    reference: str
    seconds: float
    ranges: Mapping[str, tuple[float, float]]
    values: Mapping[str, Any]
    models: tuple[str, ...]
    pace: Mapping[str, float]
    bounds: Mapping[Key, Bound]

    def bound(self, scene: Scene, model: str, question: Question) -> Bound | None:
        """Bound for scenes with this roller fit and defect; None if too few of them were measured."""
        key = scene.contact.roller_fit.value, scene.defect.kind.scene_word, model, question
        found = self.bounds.get(key)
        return found if found is not None and len(found.errors) >= LEAST_SCENES else None

    def unlike(self, scene: Scene) -> list[str]:
        """Values in which a scene differs from the measured ones, beyond their axes."""
        return list(_differences(scene_values(scene), self.values, scene.defect.kind))

    def outside(self, scene: Scene) -> tuple[str, ...]:
        """Reasons why nothing measured holds for the scene; empty if the table covers it."""
        bundled = load_scene(self.base)
        changed = list(_differences(scene_values(bundled), self.values, Fault.OUTER))
        if changed or bundled.solver.step_s != self.values["solver.step_s"]:
            what = "; ".join(changed) or "solver.step_s"
            return (f"the scene {self.base} changed since its models were measured ({what}); {REMEDY} again",)
        return (*self._beyond(scene), *self.unlike(scene), *self._coarser(scene))

    def _beyond(self, scene: Scene) -> Iterator[str]:
        kind, fit = scene.defect.kind, scene.contact.roller_fit.value
        if kind is Fault.ROLLER:
            yield "defects on rollers were not measured: no question reads their line, and the line model has none"
        elif not any(key[:2] == (fit, kind.scene_word) for key in self.bounds):
            yield f"no scene with defect {kind.scene_word} and roller fit {fit} was measured"
        axes = {"rpm": 60 * scene.shaft_hz, "radial_kn": scene.mean_radial_n / 1e3}
        if kind not in (Fault.HEALTHY, Fault.ROLLER):
            axes["height_mm"] = scene.defect.height_m * 1e3
        for axis, value in axes.items():
            low, high = self.ranges[axis]
            if not (low <= value <= high or math.isclose(value, low) or math.isclose(value, high)):
                span = " to ".join(f"{end:g}" for end in dict.fromkeys((low, high)))
                yield f"{axis.replace('_', ' in ')} = {value:.6g} lies beyond the measured {span}"

    def _coarser(self, scene: Scene) -> Iterator[str]:
        if scene.duration_s < LONGER * self.seconds:
            yield f"{scene.duration_s:g} s are short compared with the measured {self.seconds:g} s"
        step_s = self.values["solver.step_s"]
        if scene.solver.step_s > step_s * (1 + 1e-6):
            yield f"its models were measured at {step_s:.4g} s, not at the coarser {scene.solver.step_s:.4g} s"


def scene_values(scene: Scene) -> dict[str, Any]:
    """Every value of a scene by dotted key, with a digest of its bearing's data."""
    bearing = load_bearing(scene.bearing)
    digest = hashlib.sha256(repr(bearing).encode()).hexdigest()[:8]
    return dict(_flat("", scene_dict(scene) | {"bearing": f"{bearing.name} (data {digest})"}))


def _flat(path: str, table: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in table.items():
        if isinstance(value, Mapping):
            yield from _flat(f"{path}{name}.", value)
        elif value is not None and value != []:
            yield path + name, value


def _differences(own: Mapping[str, Any], measured: Mapping[str, Any], kind: Fault) -> Iterator[str]:
    unused = "defect." if kind in (Fault.HEALTHY, Fault.ROLLER) else "\0"
    for name in dict.fromkeys((*own, *measured)):
        value, right = own.get(name, WITHOUT), measured.get(name, WITHOUT)
        if name in FREE or name.startswith(unused) or value == right:
            continue
        numbers = isinstance(value, int | float) and isinstance(right, int | float)
        if not (numbers and math.isclose(value, right, rel_tol=1e-6, abs_tol=1e-15)):
            yield UNMEASURED.get(name) or f"{name} = {_text(value)}, measured only at {_text(right)}"


def _text(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, float) else ("a list" if isinstance(value, list) else str(value))


@cache
def measured_errors() -> Mapping[str, MeasuredErrors]:
    """The newest tables, by bundled scene; `DataError` if there are none."""
    found = newest_result(RESULT)
    if found is None:
        raise DataError(f"reports/{RESULT}.json: no measured errors of the models; {REMEDY}.")
    return read_errors(found.content)


def read_errors(content: Mapping[str, Any]) -> Mapping[str, MeasuredErrors]:
    """Tables from the content of the study's result; `DataError` if it holds none."""
    try:
        tables = {name: _table(name, about, content["rows"]) for name, about in content["bases"].items()}
        if not tables:
            raise ValueError("no scene")
        return tables
    except (ArithmeticError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise DataError(f"{RESULT}: not a table of measured errors ({error!r}); {REMEDY} anew.") from error


def _table(base: str, about: Mapping[str, Any], rows: list[Mapping[str, Any]]) -> MeasuredErrors:
    errors: dict[Key, list[float]] = {}
    for row in (row for row in rows if row["base"] == base):
        for question, error in row["error_pct"].items():
            key = row["fit"], row["kind"], row["model"], Question(question)
            errors.setdefault(key, []).append(math.inf if error is None else float(error))
    ranges = {axis: (float(low), float(high)) for axis, (low, high) in about["ranges"].items()}
    pace = {model: float(wall) for model, wall in about["pace"].items()}
    numbers = (float(about["seconds"]), float(about["values"]["solver.step_s"]), *pace.values())
    if not math.isfinite(sum(numbers)) or any(math.isnan(error) for of in errors.values() for error in of):
        raise ValueError("numbers that are none")
    load_scene(base)
    return MeasuredErrors(
        base=base,
        reference=about["reference"],
        seconds=numbers[0],
        ranges={axis: ranges[axis] for axis in ("rpm", "radial_kn", "height_mm")},
        values=about["values"],
        models=tuple(about["models"]),
        pace=pace,
        bounds={key: Bound(errors=tuple(sorted(of))) for key, of in errors.items()},
    )


def table_about(scene: Scene) -> MeasuredErrors:
    """The table whose scene differs least from this one; the first of those that differ alike."""
    return min(measured_errors().values(), key=lambda table: len(table.unlike(scene)))
