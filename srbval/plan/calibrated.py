"""What the calibration table says of a scene: errors and costs of the calibration scenes about it, or that it lies
outside; bounds of a model's error there, from how far errors between the calibration scenes go beyond theirs.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from srbval.bearing import Fault
from srbval.plan.questions import Question
from srbval.plan.table import BASES, CalibrationScene, CalibrationTable, Entry, load_calibration
from srbval.scene import Scene
from srbval.storage.installation import package_folder

# What a calibration scene has in common with its base's: everything but these, which are the table's axes or do not
# change an answer but through its length.
FREE = ("model", "shaft_speed_rad_s", "duration_s", "settle_s", "output_rate_hz", "detail_rate_hz", "seed")
LONGER = 0.6  # a record may be this much of the calibrated length, or longer
SAME = 1e-9
AXES = ("rpm", "radial_kn", "height_mm")
UNMEASURED = {
    "bodies.free_rollers": "rollers that tilt and slide along their axes (bodies.free_rollers) were not measured"
}
LEAST_SCENES = 9  # that a margin is read from: it then holds for nine scenes in ten

Key = tuple[str, str, Question]  # roller fit, model, question


@dataclass(frozen=True, kw_only=True)
class Margin:
    """Factor on the largest error at the corners, at least 1, and the number of `scenes` that it was read from."""

    factor: float
    scenes: int

    @property
    def coverage(self) -> float:
        """Chance that the bound holds for a new scene like these, at least."""
        return self.scenes / (self.scenes + 1)


@cache
def shipped_calibration(base: str = "paper") -> CalibrationTable:
    """The table about a bundled scene that comes with the program."""
    return load_calibration(package_folder() / "plan" / f"calibration_{base}.json")


def calibration_of(scene: Scene) -> CalibrationTable:
    """The shipped table whose base the scene differs least from; the paper's of two alike."""
    return min(map(shipped_calibration, BASES), key=lambda table: len(_unlike(table, scene)))


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """Calibration scenes about a scene, the corners of its grid cell; `outside`: what is not covered, and why.

    `margin`: see `margins`.
    """

    entries: tuple[Entry, ...]
    outside: tuple[str, ...]
    margin: Mapping[Key, Margin]

    def margin_of(self, model: str, question: Question) -> Margin | None:
        """A model's, for the scene's roller fit."""
        return self.margin.get((self.entries[0].case.fit, model, question))

    def error_pct(self, model: str, question: Question) -> float | None:
        """The largest error of a model among them, times its margin; None where any has no answer, or none a margin."""
        largest = largest_error_pct(self.entries, model, question)
        margin = self.margin_of(model, question)
        return None if largest is None or margin is None else largest * margin.factor

    def wall_per_simulated_s(self, model: str) -> float | None:
        """The largest cost of a model among them."""
        walls = [e.levels[model].wall_per_simulated_s for e in self.entries if model in e.levels]
        return max((wall for wall in walls if wall is not None), default=None)


def neighbours(calibration: CalibrationTable, scene: Scene) -> Neighbours:
    """The corners of the calibration grid's cell that holds `scene`, clamped to the grid where it lies outside."""
    outside = _unlike(calibration, scene)
    case = CalibrationScene(
        base=calibration.base,
        kind=scene.defect.kind.scene_word,
        fit=scene.contact.roller_fit.value,
        rpm=60 * scene.shaft_hz,
        radial_kn=scene.mean_radial_n / 1e3,
        height_mm=0.0 if scene.defect.kind is Fault.HEALTHY else scene.defect.height_m * 1e3,
    )
    same = [e for e in calibration.entries if (e.case.kind, e.case.fit) == (case.kind, case.fit)]
    if not same:
        outside.insert(
            0,
            "defects on rollers were not measured: no question reads their line, and the line model has none"
            if case.kind == Fault.ROLLER
            else f"no scene with defect {case.kind} and roller fit {case.fit} was measured",
        )
        same = [e for e in calibration.entries if e.case.kind == case.kind] or list(calibration.entries)
        case = replace(case, kind=same[0].case.kind, fit=same[0].case.fit)
    for axis in AXES:
        known, value = known_values(same, axis), getattr(case, axis)
        if not known[0] - SAME <= value <= known[-1] + SAME:
            span = " to ".join(f"{end:g}" for end in dict.fromkeys((known[0], known[-1])))
            outside.append(f"{axis.replace('_', ' in ')} = {value:.6g} lies beyond the measured {span}")
    return Neighbours(entries=tuple(corners(same, case)), outside=tuple(outside), margin=margins(calibration))


def _unlike(calibration: CalibrationTable, scene: Scene) -> list[str]:
    """In what a scene differs from the calibrated ones beyond their axes."""
    base = BASES[calibration.base].scene
    like = vars(scene) | {
        **{name: getattr(base, name) for name in FREE},
        "solver": base.solver,
        "load": replace(scene.load, radial_n=base.load.radial_n),
        "contact": replace(scene.contact, roller_fit=base.contact.roller_fit),
        "defect": base.defect
        if scene.defect.kind is Fault.ROLLER  # said in a word of its own
        else replace(scene.defect, kind=base.defect.kind, height_m=base.defect.height_m),
    }
    found = _differences("", like, vars(base))
    if scene.duration_s < LONGER * calibration.seconds:
        found.append(f"{scene.duration_s:g} s are short compared with the calibrated {calibration.seconds:g} s")
    if scene.solver.name != calibration.solver or scene.solver.step_s > calibration.step_s * (1 + 1e-6):
        found.append(
            f"its models were measured with {calibration.solver} at {calibration.step_s:.4g} s, "
            f"not {scene.solver.name} at {scene.solver.step_s:.4g} s"
        )
    return found


def _differences(path: str, own: Mapping[str, object], base: Mapping[str, object]) -> list[str]:
    found = []
    for name, value in own.items():
        right = base[name]
        if hasattr(value, "__dataclass_fields__") and hasattr(right, "__dataclass_fields__"):
            found += _differences(f"{path}{name}.", vars(value), vars(right))
        elif isinstance(value, float) and isinstance(right, float):
            if not math.isclose(value, right, rel_tol=1e-6, abs_tol=1e-15):
                found.append(f"{path}{name} = {value:.6g}, measured only at {right:.6g}")
        elif value != right:
            found.append(
                UNMEASURED.get(path + name) or f"{path}{name} = {_text(value)}, measured only at {_text(right)}"
            )
    return found


def _text(value: object) -> str:
    nested = hasattr(value, "__dict__") and not isinstance(value, str)  # an enum's member is a word
    return f"{value:.6g}" if isinstance(value, float) else ("a table" if nested else str(value))


def corners(entries: Iterable[Entry], case: CalibrationScene) -> list[Entry]:
    """The entries at the corners of the grid cell that holds `case`, clamped to the grid; empty without its kind and
    fit.
    """
    found = [e for e in entries if (e.case.kind, e.case.fit) == (case.kind, case.fit)]
    for axis in AXES:
        known, value = known_values(found, axis), getattr(case, axis)
        low = max((k for k in known if k <= value + SAME), default=min(known, default=value))
        high = min((k for k in known if k >= value - SAME), default=max(known, default=value))
        found = [e for e in found if getattr(e.case, axis) in (low, high)]
    return found


def known_values(entries: Iterable[Entry], axis: str) -> list[float]:
    """The values of an axis, in ascending order."""
    return sorted({getattr(e.case, axis) for e in entries})


def largest_error_pct(entries: Sequence[Entry], model: str, question: Question) -> float | None:
    """The largest error of a model among the entries; None where any has no answer."""
    errors = [e.levels[model].error_pct.get(question) if model in e.levels else None for e in entries]
    known = [error for error in errors if error is not None]
    return max(known) if known and len(known) == len(errors) else None


@cache
def margins(calibration: CalibrationTable) -> Mapping[Key, Margin]:
    """For each roller fit, model and question: the factor on the largest error at the corners.

    The fits are kept apart because rollers rattle with play, while the ring rings with interference. Split conformal
    prediction (Vovk, Gammerman & Shafer 2005; Lei et al. 2018, J. Am. Stat. Assoc. 113, 1094): of n scenes between the
    calibration's, drawn like the one that is asked for, the largest ratio of measured to predicted error is exceeded by
    a new one with a chance of at most 1 / (n + 1), whatever the distribution. Too few scenes give no margin.
    """
    seen: dict[Key, list[float]] = {}
    for entry in calibration.between:
        near = corners(calibration.entries, entry.case)
        for model in calibration.models:
            for question in entry.reference:
                measured = entry.levels[model].error_pct.get(question)
                predicted = largest_error_pct(near, model, question)
                if measured is not None and predicted:
                    seen.setdefault((entry.case.fit, model, question), []).append(measured / predicted)
    return {
        key: Margin(factor=max(1.0, *ratios), scenes=len(ratios))
        for key, ratios in seen.items()
        if len(ratios) >= LEAST_SCENES
    }
