"""Runs of the bundled model, and the counterpart of each recording: a run at the recording's own speed and load."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.comparison.compared_quantities import read_quantities
from srbval.comparison.comparison import QuantityValue
from srbval.models.run import Run
from srbval.models.simulate import Step, stored_run
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analysis_once
from srbval.recordings import recording_from_run
from srbval.scene import Scene, load_scene, paper_scene, with_points
from srbval.sweep.pool import side_by_side

PAPER_STATES = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
# Length of a run in shaft turns, and its upper limit [s]; the rig's records last 2 s at any speed.
TURNS, MAX_COUNTERPART_S = 30.0, 2.1
# Rate at which the rollers' speeds are recorded, by fault: only a roller defect needs them.
DETAIL_HZ = {Fault.ROLLER: 1024.0}
# With this many points on a circle levels change by less than 0.1 dB with more points, and runs do not depend on their
# start. With the paper's 500 points levels scatter by 0.1 to 1.7 dB with the start.
CONVERGED_POINTS = 2000


@dataclass(frozen=True, kw_only=True, eq=False)
class AnalysedRun:
    """A run, its analysis, and the compared `values` by name."""

    run: Run
    analysis: Analysis
    values: Mapping[str, QuantityValue]

    @property
    def state(self) -> Fault:
        """State of the simulated bearing: the part with a defect, or healthy."""
        return self.run.scene.defect.kind


def paper_runs(seconds: float, *, jobs: int | None = None, progress: Progress = silent) -> dict[str, Run]:
    """Simulate the paper's scene (710 rpm, 124.8 kN) for `seconds`, with `PAPER_STATES`; runs by name, ``paper-outer``.

    The runs are parallel. Raises `NumericsError` if a run fails.
    """
    scenes = {f"paper-{state}": paper_scene(duration_s=seconds, defect=state.value) for state in PAPER_STATES}
    return side_by_side(
        scenes, lambda name, own: run_named(name, scenes[name], own), task="Simulate", jobs=jobs, progress=progress
    )


def run_named(name: str, scene: Scene, progress: Progress = silent) -> Run:
    """Simulate a scene or read its stored run; raises `NumericsError` with the run's `name` if it fails."""
    run = stored_run(scene, step=Step.CHECKED, progress=lambda task, fraction: progress(f"{task} {name}", fraction))
    return run.require_usable(f"case {name}: run")


def converged(scene: Scene) -> Scene:
    """Scene with at least `CONVERGED_POINTS` contact points per race circle, if its model has such points."""
    coarse = scene.model == "full" and scene.contact.points_per_circle < CONVERGED_POINTS
    return with_points(scene, CONVERGED_POINTS) if coarse else scene


def run_counterpart(
    rig: Analysis,
    state: Fault,
    base: str = "paper",
    band_hz: tuple[float, float] | None = None,
    *,
    model: str = "",
    bearing_name: str = DEFAULT_BEARING,
    progress: Progress = silent,
) -> AnalysedRun:
    """Simulate the recording analysed in `rig`: scene `base` at the recording's speed and load with defect `state`.

    `model` replaces the scene's model; `bearing_name` is the name or file of the recording's bearing. If the recording
    states no load, the scene's load applies. The speed is rounded to 1e-6 Hz: further digits differ between computers.
    """
    recording, bearing = rig.recording, rig.bearing
    shaft_hz = round(rig.speed.value_hz, 6)
    loads = {"radial_n": recording.radial_n, "axial_n": recording.axial_n}
    changes: dict[str, Any] = {
        "duration_s": min(TURNS / shaft_hz, MAX_COUNTERPART_S),
        "shaft_speed_rad_s": 2 * math.pi * shaft_hz,
        "load": {key: value for key, value in loads.items() if value is not None},
        "defect": {"kind": state.scene_word},
        "detail_rate_hz": DETAIL_HZ.get(state, 0.0),
    }
    if bearing.geometry is None or bearing.geometry != load_bearing(DEFAULT_BEARING).geometry:
        changes["bearing"] = bearing_name
    if model:
        changes["model"] = model
    run = run_named(f"counterpart-{recording.name}", converged(load_scene(base, changes)), progress)
    return analyse_run(run, bearing, band_hz)


def analyse_run(run: Run, bearing: Bearing, band_hz: tuple[float, float] | None = None) -> AnalysedRun:
    """Analyse a run, by default in the paper's envelope band, and read the compared quantities.

    The line of a roller fault is searched for at the order computed from the run (see `compute_line_order`).
    """
    state = run.scene.defect.kind
    order = compute_line_order(run, state, bearing)
    if state is Fault.ROLLER and order is not None:
        bearing = replace(bearing, orders=replace(bearing.orders, bsf=order / 2))
    analysis = analysis_once(recording_from_run(run), bearing, band_hz=band_hz)
    return AnalysedRun(run=run, analysis=analysis, values=read_quantities(analysis, state, order))


def compute_line_order(run: Run, state: Fault, bearing: Bearing) -> float | None:
    """Order of the fault line of `state` (frequency over shaft speed), from the run's mean cage or roller speed.

    None if the bearing is healthy or the speed unknown. A defect on a roller strikes each race once per revolution of
    the roller about its axis, relative to the cage. This axis is tilted against the shaft; the part of the cage's
    rotation about it is the cage speed times the cosine of the tilt.
    """
    if state is not Fault.ROLLER:
        return None if math.isnan(run.cage_ratio) else state.passing_order(run.rolling_elements, run.cage_ratio)
    if not run.spin_rad_s.size or bearing.geometry is None:
        return None
    defect = run.scene.defect
    spin = run.spin_rad_s[:, (defect.row - 1) * run.rolling_elements + defect.roller - 1]
    slot = run.cage_ratio * math.cos(bearing.geometry.tilt_rad)
    return 2 * abs(float(spin.mean()) / run.scene.shaft_speed_rad_s - slot)
