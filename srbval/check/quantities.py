"""The quantities that are checked: each group is computed anew from one base scene.

A group is a function of that scene to values by name. What cannot be computed here, for want of a recording, is None;
what could not be computed because something failed is NaN.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.check.runs import Values, balance, measures_of, printed, read_line, run_side_by_side, with_defect
from srbval.progress import Progress
from srbval.recordings import load_recording
from srbval.recordings.registry import find_recording
from srbval.scene import Scene
from srbval.validation.analyse import analyse

RIG_RPM = 877.0  # nominal motor speed of those open excerpts that are nearest to the paper's
LOWER_RUNGS = ("impulse", "planar", "line")


def kinematics(base: Scene, _: Progress) -> Values:
    """Fault orders in closed form."""
    orders = load_bearing(base.bearing).orders
    return {f"order_{name}": getattr(orders, name) for name in ("bpfo", "bpfi", "bsf", "ftf")}


def statics(base: Scene, _: Progress) -> Values:
    """Static balance: deterministic, and depends on the stiffness, the fit and every circle's radius."""
    scenes = {"play": base, "printed": printed(base)}
    return {f"static_{name}_{fit}": value for fit, scene in scenes.items() for name, value in balance(scene).items()}


def runs(base: Scene, progress: Progress) -> Values:
    """The paper's scene without and with a defect on either race, and the printed fit: the runs behind Table 6."""
    outer = with_defect(base, Fault.OUTER)
    scenes = {
        "healthy": with_defect(base, Fault.HEALTHY),
        "outer": outer,
        "inner": with_defect(base, Fault.INNER),
        "outer_printed": printed(outer),
    }
    done = run_side_by_side(scenes, progress)
    found: dict[str, float | None] = {
        f"{quantity}_{name}": value for name, run in done.items() for quantity, value in measures_of(run).items()
    }
    return found | {
        "failed_runs": float(sum(run is None for run in done.values())),
        "read_bpfo_hz": read_line(done["outer"], "BPFO"),
        "read_bpfi_hz": read_line(done["inner"], "BPFI"),
    }


def ladder(base: Scene, progress: Progress) -> Values:
    """The lower rungs that vibrate, on the outer-race scene."""
    outer = with_defect(base, Fault.OUTER)
    done = run_side_by_side({model: replace(outer, model=model) for model in LOWER_RUNGS}, progress)
    return {f"read_bpfo_hz_{model}": read_line(run, "BPFO") for model, run in done.items()}


def rig(base: Scene, _: Progress) -> Values:
    """Lines of the rig's own recordings, where they are registered: the pipeline on measured vibration."""
    bearing, found = load_bearing(base.bearing), dict[str, float | None]()
    for state in RACE_DEFECTS:
        entry = find_recording(state=state, nominal_rpm=RIG_RPM)
        found[f"rig_order_{state.value}"] = None
        if entry is not None:
            analysis = analyse(load_recording(entry.file), bearing=bearing)
            hz = analysis.line_of(state).found_hz
            found[f"rig_order_{state.value}"] = float("nan") if hz is None else hz / analysis.speed.value_hz
    return found


GROUPS: Mapping[str, Callable[[Scene, Progress], Values]] = {
    "kinematics": kinematics,
    "statics": statics,
    "runs": runs,
    "ladder": ladder,
    "rig": rig,
}
