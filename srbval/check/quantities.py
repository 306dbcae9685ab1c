"""The quantities that are checked: each group is recomputed from one base scene.

A group is a function of that scene to values by name. What cannot be computed here, for want of a recording, is None;
what could not be computed because something failed is NaN.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import make_parameters
from srbval.models.full_run import static_share
from srbval.models.precompile import load_kernels
from srbval.models.run import Run
from srbval.models.simulate import stored_run
from srbval.plan.measures import measure
from srbval.progress import Progress
from srbval.reading.analyse import analyse
from srbval.recordings import load_recording, recording_from_run
from srbval.recordings.registry import find_recording
from srbval.scene import RollerFit, Scene
from srbval.sweep.pool import Attempt, run_all

Values = Mapping[str, float | None]

SECONDS = 2.0  # recorded: long enough to read a line to 0.05 Hz, short enough for a check to be made often
RIG_RPM = 877.0  # nominal motor speed of those open excerpts that are nearest to the paper's
LOWER_LEVELS = ("impulse", "planar", "line")


def _printed(base: Scene) -> Scene:
    """The same with the roller diameter printed in Table 1: every roller is loaded, nothing rattles."""
    return replace(base, contact=replace(base.contact, roller_fit=RollerFit.PRINTED))


def _with_defect(base: Scene, kind: Fault) -> Scene:
    return replace(base, defect=replace(base.defect, kind=kind), duration_s=SECONDS)


def _run_side_by_side(scenes: Mapping[str, Scene], progress: Progress) -> dict[str, Run | None]:
    """Run every scene, one per core at a time; None where a run failed or found no start."""

    def read(_: str, tried: Attempt, __: float) -> Run | None:
        return tried.run if tried.works else None

    return run_all(scenes, read, task="runs", make=stored_run, progress=progress)


def _measures_of(run: Run | None) -> dict[str, float]:
    """Cage, load, slip power and vibration of a run; NaN throughout where it failed."""
    if run is None:
        return dict.fromkeys(("cage_ratio", "roller_load_share", "slip_power_w", "band_rms_m_s2"), math.nan)
    measured = measure(run)
    return {
        "cage_ratio": measured.cage_ratio,
        "roller_load_share": run.roller_load_share,
        "slip_power_w": float(run.energy.friction_w.mean()),
        "band_rms_m_s2": measured.band_rms_m_s2,
    }


def _read_line(run: Run | None, name: str) -> float:
    """A fault line as the pipeline reads it from a run [Hz]; NaN where the run failed or it is not found."""
    if run is None:
        return math.nan
    found = analyse(recording_from_run(run), bearing=load_bearing(run.scene.bearing)).line(name).found_hz
    return math.nan if found is None else float(found)


def _balance(scene: Scene) -> dict[str, float]:
    """Static balance: ring displacement along y [um] and the rollers' part of the load; NaN where there is none."""
    bearing = load_bearing(scene.bearing)
    if bearing.geometry is None:
        raise ConfigurationError(f"bearing {bearing.name!r} has no [geometry]; it has no static balance.")
    load_kernels([scene])
    model = make_parameters(scene, bearing.geometry)
    try:
        state = equilibrium_state(model)
    except ConfigurationError:  # the reference scenes have one: the model is at fault
        return {"ring_um": math.nan, "roller_share": math.nan}
    ring = state[len(state) // 2 - 3 : len(state) // 2]
    share = static_share(scene, model, ring)
    return {"ring_um": float(ring[1]) * 1e6, "roller_share": share}


def _kinematics(base: Scene, _: Progress) -> Values:
    """Fault orders in closed form."""
    orders = load_bearing(base.bearing).orders
    return {f"order_{name}": getattr(orders, name) for name in ("bpfo", "bpfi", "bsf", "ftf")}


def _statics(base: Scene, _: Progress) -> Values:
    """Static balance: deterministic, and depends on the stiffness, the fit and every circle's radius."""
    scenes = {"play": base, "printed": _printed(base)}
    return {f"static_{name}_{fit}": value for fit, scene in scenes.items() for name, value in _balance(scene).items()}


def _runs(base: Scene, progress: Progress) -> Values:
    """The paper's scene without and with a defect on either race, and the printed fit: the runs behind Table 6."""
    kinds = {"healthy": Fault.HEALTHY, "outer": Fault.OUTER, "inner": Fault.INNER}
    scenes = {name: _with_defect(base, kind) for name, kind in kinds.items()}
    done = _run_side_by_side(scenes | {"outer_printed": _printed(scenes["outer"])}, progress)
    return {
        **{f"{quantity}_{name}": value for name, run in done.items() for quantity, value in _measures_of(run).items()},
        "failed_runs": float(sum(run is None for run in done.values())),
        "read_bpfo_hz": _read_line(done["outer"], "BPFO"),
        "read_bpfi_hz": _read_line(done["inner"], "BPFI"),
    }


def _lower_levels(base: Scene, progress: Progress) -> Values:
    """The lower fidelity levels that vibrate, on the outer-race scene."""
    outer = _with_defect(base, Fault.OUTER)
    done = _run_side_by_side({model: replace(outer, model=model) for model in LOWER_LEVELS}, progress)
    return {f"read_bpfo_hz_{model}": _read_line(run, "BPFO") for model, run in done.items()}


def _rig(base: Scene, _: Progress) -> Values:
    """Lines of the rig's own recordings, where they are registered: the pipeline on measured vibration."""
    bearing, found = load_bearing(base.bearing), dict[str, float | None]()
    for state in RACE_DEFECTS:
        entry, name = find_recording(state=state, nominal_rpm=RIG_RPM), f"rig_order_{state.value}"
        found[name] = None
        if entry is not None:
            analysis = analyse(load_recording(entry.file), bearing=bearing)
            hz = analysis.line_of(state).found_hz
            found[name] = math.nan if hz is None else hz / analysis.speed.value_hz
    return found


GROUPS: Mapping[str, Callable[[Scene, Progress], Values]] = {
    "kinematics": _kinematics, "statics": _statics, "runs": _runs, "ladder": _lower_levels, "rig": _rig,
}  # fmt: skip
