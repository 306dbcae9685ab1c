"""Errors of each model against a reference, from the study ``model_levels``, and the scenes to which they apply."""

import hashlib
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cache
from typing import Any, ClassVar

from srbval.bearing import RACE_DEFECTS, load_bearing
from srbval.errors import DataError
from srbval.models.run_file import scene_dict
from srbval.plan.questions import Question
from srbval.scene import Scene, load_scene
from srbval.storage.stored_result import newest_result
from srbval.storage.tables import walk_leaves

ERRORS_RESULT = "model_levels"
REMEDY = f"srbval evidence {ERRORS_RESULT} measures them"
MIN_SCENES_FOR_BOUND = 9  # a bound from nine scenes is kept on nine of ten further scenes
MIN_DURATION_SHARE = 0.58  # shortest of the measured runs, as a share of the longest
# Axes of the table, and settings that change an answer only through the length of the record.
AXIS_KEYS = {"model", "shaft_speed_rad_s", "duration_s", "settle_s", "output_rate_hz", "detail_rate_hz", "seed"}
AXIS_KEYS |= {"solver.step_s", "load.radial_n", "contact.roller_fit", "defect.kind", "defect.height_m"}
BoundKey = tuple[str, str, str, str]  # roller fit, defect, model, question


@dataclass(frozen=True, kw_only=True)
class Bound:
    """Errors [%] of one model's answers to one question, over `scenes` random scenes.

    `error_pct` is the largest error, which bounds the error of the next scene; None if the model gave no answer on one
    of the scenes (`silent` counts these). `median_pct` is the median error, `ci95_pct` its 95 % confidence interval.
    """

    JSON_PROPERTIES: ClassVar = ("coverage",)

    scenes: int
    silent: int
    error_pct: float | None
    median_pct: float | None
    ci95_pct: tuple[float | None, float | None]

    @property
    def coverage(self) -> float:
        """Least probability that the error on one more random scene, drawn like the `scenes`, is within the bound.

        Each of the `scenes` + 1 errors is equally likely to be the largest (split conformal prediction; Vovk, Gammerman
        & Shafer 2005; Lei et al. 2018, J. Am. Stat. Assoc. 113, 1094).
        """
        return self.scenes / (self.scenes + 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class MeasuredErrors:
    """Measured errors of models on scenes near the bundled scene `base`, against the model `reference` at a finer step.

    Runs last up to `seconds`, at the lowest speed. `ranges` contains the least and greatest value of each axis
    (varied setting). `values` contains, by dotted key, the settings of the scene `base` at the time of measurement.
    `pace` is the wall time of each model per simulated second [s/s]. `models` are sorted from the simplest to the
    most detailed.
    """

    base: str
    reference: str
    seconds: float
    ranges: Mapping[str, tuple[float, float]]
    values: Mapping[str, Any]
    models: Sequence[str]
    pace: Mapping[str, float]
    bounds: Mapping[BoundKey, Bound]

    def bound(self, scene: Scene, model: str, question: Question) -> Bound | None:
        """Error bound of a model on scenes with the defect and roller fit of `scene`; None if it is not known.

        A bound must have been measured on at least `MIN_SCENES_FOR_BOUND` scenes.
        """
        key = scene.contact.roller_fit.value, scene.defect.kind.scene_word, model, question
        found = self.bounds.get(key)
        return found if found is not None and found.scenes >= MIN_SCENES_FOR_BOUND else None

    def list_differences(self, settings: Mapping[str, Any]) -> list[str]:
        """List in words where the `settings` of a scene (see `scene_values`) differ from those of the measured scenes.

        Settings that were varied in the measurements are ignored, as are those of a defect that is not on a race.
        """
        ignored = () if settings["defect.kind"] in RACE_DEFECTS else ("defect.",)
        both = {name: (settings.get(name), self.values.get(name)) for name in (*settings, *self.values)}
        return [
            f"{name} = {_describe_value(own)}, measured only at {_describe_value(measured)}"
            for name, (own, measured) in both.items()
            if not (name in AXIS_KEYS or name.startswith(ignored) or _nearly_equal(own, measured))
        ]

    def list_gaps(self, scene: Scene) -> tuple[str, ...]:
        """List the reasons why the measured errors do not apply to a scene; empty if they apply."""
        bundled, step_s = load_scene(self.base, {"defect": {"kind": "outer"}}), self.values["solver.step_s"]
        changed = self.list_differences(scene_values(bundled)) + ["solver.step_s"] * (bundled.solver.step_s != step_s)
        if changed:
            text = "; ".join(changed)
            return (f"the scene {self.base} changed since its models were measured ({text}); {REMEDY} again",)
        return (*self._list_exceeded_axes(scene), *self.list_differences(scene_values(scene)))

    def _list_exceeded_axes(self, scene: Scene) -> Iterator[str]:
        """List the properties of a scene (defect, speed, load, duration, step) outside the measured ranges."""
        kind, fit, step_s = scene.defect.kind, scene.contact.roller_fit.value, self.values["solver.step_s"]
        if not any(key[:2] == (fit, kind.scene_word) for key in self.bounds):
            yield f"no scene with defect {kind.scene_word} and roller fit {fit} was measured"
        axes = {"rpm": 60 * scene.shaft_hz, "radial_kn": scene.mean_radial_n / 1e3}
        if kind in RACE_DEFECTS:
            axes["height_mm"] = scene.defect.height_m * 1e3
        for axis, value in axes.items():
            low, high = self.ranges[axis]
            if not (low <= value <= high or _nearly_equal(value, low) or _nearly_equal(value, high)):
                yield f"{axis.replace('_', ' in ')} = {value:.6g} is outside the measured range, {low:g} to {high:g}"
        if scene.duration_s < MIN_DURATION_SHARE * self.seconds:
            yield f"{scene.duration_s:g} s is too short: errors were measured in runs of up to {self.seconds:.3g} s"
        if scene.solver.step_s > step_s * (1 + 1e-6):
            yield f"the step, {scene.solver.step_s:.4g} s, is coarser than in the measurements, {step_s:.4g} s"


def scene_values(scene: Scene) -> dict[str, Any]:
    """Settings of a scene by dotted key; a hash of the data represents the bearing."""
    bearing = load_bearing(scene.bearing)
    digest = hashlib.sha256(repr(bearing).encode()).hexdigest()[:8]
    values = walk_leaves(scene_dict(scene) | {"bearing": f"{bearing.name} (data {digest})"})
    return {key: value for key, value in values if value is not None and value != []}


def _nearly_equal(one: Any, other: Any) -> bool:
    numbers = isinstance(one, int | float) and isinstance(other, int | float)
    return one == other or (numbers and math.isclose(one, other, rel_tol=1e-6, abs_tol=1e-15))


def _describe_value(value: Any) -> str:
    plain = "nothing" if value is None else "a list" if isinstance(value, list) else str(value)
    return f"{value:.6g}" if isinstance(value, float) else plain


@cache
def measured_errors() -> Mapping[str, MeasuredErrors]:
    """Load the newest tables of measured errors, by bundled scene; `DataError` if no result is stored."""
    if found := newest_result(ERRORS_RESULT):
        return read_errors(found.content)
    raise DataError(f"reports/{ERRORS_RESULT}.json: the measured errors of the models are missing; {REMEDY}.")


def read_errors(content: Mapping[str, Any]) -> Mapping[str, MeasuredErrors]:
    """Convert the content of the result ``model_levels`` to tables by scene."""
    bounds = defaultdict[str, dict[BoundKey, Bound]](dict)
    for row in content["bounds"]:
        key = row["fit"], row["kind"], row["model"], row["question"]
        bounds[row["base"]][key] = Bound(**{one.name: row[one.name] for one in fields(Bound)})
    return {base: MeasuredErrors(base=base, bounds=bounds[base], **about) for base, about in content["bases"].items()}


def nearest_table(scene: Scene) -> MeasuredErrors:
    """Table of measured errors whose scene differs from `scene` in the fewest settings."""
    settings = scene_values(scene)
    return min(measured_errors().values(), key=lambda table: len(table.list_differences(settings)))
