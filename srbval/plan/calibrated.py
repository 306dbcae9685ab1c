"""What the calibration table says of a scene: errors and costs of the calibration scenes about it, or that it lies
outside.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache

from srbval.bearing import Fault
from srbval.bench.ladder.cases import CalibrationScene
from srbval.bench.ladder.questions import Question
from srbval.bench.ladder.table import Entry, LadderCalibration, load_calibration
from srbval.plan.error_bounds import AXES, SAME, Key, corners, known_values, largest_error_pct, margins
from srbval.scene import Scene, paper_scene
from srbval.storage.own_package import package_folder

SHIPPED = "calibration.json"
# What a calibration scene has in common with the paper's: everything but these, which are the table's axes or do not
# change an answer but through its length.
FREE = ("model", "shaft_speed_rad_s", "duration_s", "settle_s", "output_rate_hz", "detail_rate_hz", "seed")
LONGER = 0.6  # a record may be this much of the calibrated length, or longer


@cache
def shipped_calibration() -> LadderCalibration:
    """The table that comes with the program."""
    return load_calibration(package_folder() / "plan" / SHIPPED)


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """Calibration scenes about a scene, the corners of its grid cell; `outside`: what is not covered, and why.

    `margin`: see `margins`.
    """

    entries: tuple[Entry, ...]
    outside: tuple[str, ...]
    margin: Mapping[Key, float]

    def error_pct(self, model: str, question: Question) -> float | None:
        """The largest error of a rung among them, times its margin; None where any has no answer, or none a margin."""
        largest = largest_error_pct(self.entries, model, question)
        factor = self.margin.get((self.entries[0].case.fit, model, question))
        return None if largest is None or factor is None else largest * factor

    def wall_per_simulated_s(self, model: str) -> float | None:
        """The largest cost of a rung among them."""
        walls = [e.rungs[model].wall_per_simulated_s for e in self.entries if model in e.rungs]
        return max((wall for wall in walls if wall is not None), default=None)


def neighbours(calibration: LadderCalibration, scene: Scene) -> Neighbours:
    """The corners of the calibration grid's cell that holds `scene`, clamped to the grid where it lies outside."""
    outside = [*_unlike(calibration, scene)]
    case = CalibrationScene(
        kind=scene.defect.kind.scene_word,
        fit=scene.contact.roller_fit.value,
        rpm=60 * scene.shaft_hz,
        radial_kn=scene.mean_radial_n / 1e3,
        height_mm=0.0 if scene.defect.kind is Fault.HEALTHY else scene.defect.height_m * 1e3,
    )
    same = [e for e in calibration.entries if (e.case.kind, e.case.fit) == (case.kind, case.fit)]
    if not same:
        outside.insert(0, _unmeasured(case))
        same = [e for e in calibration.entries if e.case.kind == case.kind] or list(calibration.entries)
        case = replace(case, kind=same[0].case.kind, fit=same[0].case.fit)
    for axis in AXES:
        known, value = known_values(same, axis), getattr(case, axis)
        if not known[0] - SAME <= value <= known[-1] + SAME:
            outside.append(f"{axis.replace('_', ' in ')} = {value:.6g} lies beyond the measured {_range(known)}")
    return Neighbours(entries=tuple(corners(same, case)), outside=tuple(outside), margin=margins(calibration))


def _unmeasured(case: CalibrationScene) -> str:
    if case.kind == Fault.ROLLER:
        return "defects on rollers were not measured: no question reads their line, and the line rung has none"
    return f"no scene with defect {case.kind} and roller fit {case.fit} was measured"


def _range(known: Sequence[float]) -> str:
    return f"{known[0]:g}" if len(known) == 1 else f"{known[0]:g} to {known[-1]:g}"


def _unlike(calibration: LadderCalibration, scene: Scene) -> list[str]:
    """In what a scene differs from the calibrated ones beyond their axes."""
    paper = paper_scene()
    like = replace(
        scene,
        **{name: getattr(paper, name) for name in FREE},
        solver=paper.solver,
        load=replace(scene.load, radial_n=paper.load.radial_n),
        contact=replace(scene.contact, roller_fit=paper.contact.roller_fit),
        defect=paper.defect
        if scene.defect.kind is Fault.ROLLER  # said in a word of its own
        else replace(scene.defect, kind=paper.defect.kind, height_m=paper.defect.height_m),
    )
    found = list(_differences("", vars(like), vars(paper)))
    if scene.duration_s < LONGER * calibration.seconds:
        found.append(f"{scene.duration_s:g} s are short compared with the calibrated {calibration.seconds:g} s")
    if scene.solver.name != calibration.solver or scene.solver.step_s > calibration.step_s * (1 + 1e-6):
        found.append(
            f"the full model was measured with {calibration.solver} at {calibration.step_s:.4g} s, "
            f"not {scene.solver.name} at {scene.solver.step_s:.4g} s"
        )
    return found


def _differences(path: str, own: Mapping[str, object], paper: Mapping[str, object]) -> list[str]:
    found = []
    for name, value in own.items():
        right = paper[name]
        if hasattr(value, "__dataclass_fields__") and hasattr(right, "__dataclass_fields__"):
            found += _differences(f"{path}{name}.", vars(value), vars(right))
        elif not _same(value, right):
            found.append(f"{path}{name} = {_text(value)}, measured only at {_text(right)}")
    return found


def _same(value: object, right: object) -> bool:
    if isinstance(value, float) and isinstance(right, float):
        return math.isclose(value, right, rel_tol=1e-6, abs_tol=1e-15)
    return value == right


def _text(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else ("a table" if hasattr(value, "__dict__") else str(value))
