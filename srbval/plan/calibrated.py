"""What the calibration table says of a scene: the errors and costs measured round about it, or that it lies outside."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib import resources
from pathlib import Path

from srbval.bench.ladder.questions import Question
from srbval.bench.ladder.table import Calibration, Entry, load_calibration
from srbval.scene import DefectKind, Scene, paper_scene

SHIPPED = "calibration.json"
SAME = 1e-9
# What a calibration scene has in common with the paper's: everything but these, which are the table's axes or do not
# change an answer but through its length.
FREE = ("model", "shaft_speed_rad_s", "duration_s", "settle_s", "output_rate_hz", "detail_rate_hz", "seed")
LONGER = 0.6  # a record may be this much of the calibrated length, or longer


@cache
def shipped_calibration() -> Calibration:
    """The table that comes with the program."""
    return load_calibration(Path(str(resources.files("srbval.plan") / SHIPPED)))


@dataclass(frozen=True, kw_only=True)
class Neighbours:
    """Calibration scenes about a scene, the corners of the cell it lies in; `outside`: what is not covered, and why."""

    entries: tuple[Entry, ...]
    outside: tuple[str, ...]

    def error_pct(self, model: str, question: Question) -> float | None:
        """The largest error of a rung among them; None where any has no answer."""
        errors = [e.rungs[model].error_pct.get(question) for e in self.entries if model in e.rungs]
        known = [error for error in errors if error is not None]
        return max(known) if known and len(known) == len(self.entries) else None

    def wall_per_simulated_s(self, model: str) -> float | None:
        """The largest cost of a rung among them."""
        walls = [e.rungs[model].wall_per_simulated_s for e in self.entries if model in e.rungs]
        return max((wall for wall in walls if wall is not None), default=None)


def neighbours(calibration: Calibration, scene: Scene) -> Neighbours:
    """The corners of the cell of the calibration grid that holds `scene`, clamped to the grid where it lies outside."""
    kind, fit = scene.defect.kind.value, scene.contact.roller_fit.value
    outside = [*_unlike(calibration, scene)]
    same = [e for e in calibration.entries if (e.case.kind, e.case.fit) == (kind, fit)]
    if not same:
        outside.append(f"no scene with defect {kind} and roller fit {fit} was measured")
        same = [e for e in calibration.entries if e.case.kind == kind] or list(calibration.entries)
    place = {
        "rpm": 60 * scene.shaft_hz,
        "radial_kn": scene.mean_radial_n / 1e3,
        "height_mm": 0.0 if scene.defect.kind is DefectKind.NONE else scene.defect.height_m * 1e3,
    }
    for axis, value in place.items():
        known = sorted({getattr(e.case, axis) for e in same})
        if not known[0] - SAME <= value <= known[-1] + SAME:
            outside.append(f"{axis.replace('_', ' in ')} = {value:.6g} lies beyond the measured {_range(known)}")
        keep = _bracket(known, value)
        same = [e for e in same if getattr(e.case, axis) in keep]
    return Neighbours(entries=tuple(same), outside=tuple(outside))


def _range(known: Sequence[float]) -> str:
    return f"{known[0]:g}" if len(known) == 1 else f"{known[0]:g} to {known[-1]:g}"


def _bracket(known: Sequence[float], value: float) -> set[float]:
    """The entries either side of a value; the same where it hits one or lies beyond."""
    low = max((k for k in known if k <= value + SAME), default=known[0])
    high = min((k for k in known if k >= value - SAME), default=known[-1])
    return {low, high}


def _unlike(calibration: Calibration, scene: Scene) -> list[str]:
    """In what a scene differs from the calibrated ones beyond their axes."""
    paper = paper_scene()
    like = replace(
        scene,
        **{name: getattr(paper, name) for name in FREE},
        solver=paper.solver,
        load=replace(scene.load, radial_n=paper.load.radial_n),
        contact=replace(scene.contact, roller_fit=paper.contact.roller_fit),
        defect=replace(scene.defect, kind=paper.defect.kind, height_m=paper.defect.height_m),
    )
    found = list(_differences("", vars(like), vars(paper)))
    if scene.duration_s < LONGER * calibration.seconds:
        found.append(f"{scene.duration_s:g} s are short beside the calibrated {calibration.seconds:g} s")
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
