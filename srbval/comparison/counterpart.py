"""Runs of the bundled model, and the counterpart of each recording: a run at the recording's own speed and load."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.comparison.compared_quantities import COMPARED, ComparedQuantity, read_quantities
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
class SimulationCase:
    """Run to be simulated: id, purpose, bearing state, and scene."""

    id: str
    purpose: str
    state: Fault
    scene: Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class AnalysedRun:
    """Simulated case with its run, the analysis of this run, and the compared `values` by name."""

    case: SimulationCase
    run: Run
    analysis: Analysis
    values: Mapping[str, QuantityValue]


def paper_cases(seconds: float) -> list[SimulationCase]:
    """Runs of the paper's scene (710 rpm, 124.8 kN) of length `seconds`: healthy, outer-race and inner-race defect."""
    scenes = [paper_scene(duration_s=seconds, defect=state.value) for state in PAPER_STATES]
    return [
        SimulationCase(id=f"paper-{one.defect.kind}", purpose="the paper's scene", state=one.defect.kind, scene=one)
        for one in scenes
    ]


def run_simulation_case(case: SimulationCase, progress: Progress = silent) -> Run:
    """Simulate one case or read its stored run; raises `NumericsError` with the case's id if the run fails."""
    run = stored_run(
        case.scene, step=Step.CHECKED, progress=lambda task, fraction: progress(f"{task} {case.id}", fraction)
    )
    return run.require_usable(f"case {case.id}: run")


def run_cases(
    cases: Sequence[SimulationCase], *, jobs: int | None = None, progress: Progress = silent
) -> dict[str, Run]:
    """Simulate all cases in parallel and return the runs by case id; raises `NumericsError` if a run fails."""
    scenes = {case: case.scene for case in cases}
    runs = side_by_side(scenes, run_simulation_case, task="Simulate", jobs=jobs, progress=progress)
    return {case.id: run for case, run in runs.items()}


def converged(scene: Scene) -> Scene:
    """Scene with at least `CONVERGED_POINTS` contact points per race circle, if its model has such points."""
    coarse = scene.model == "full" and scene.contact.points_per_circle < CONVERGED_POINTS
    return with_points(scene, CONVERGED_POINTS) if coarse else scene


def run_counterpart(
    rig: Analysis,
    state: Fault,
    base: str = "paper",
    band_hz: tuple[float, float] | None = None,
    quantities: Iterable[ComparedQuantity] = COMPARED,
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
    scene, purpose = converged(load_scene(base, changes)), "at the recording's own speed and load"
    case = SimulationCase(id=f"counterpart-{recording.name}", purpose=purpose, state=state, scene=scene)
    return analyse_run(case, run_simulation_case(case, progress), bearing, band_hz, quantities)


def analyse_run(
    case: SimulationCase,
    run: Run,
    bearing: Bearing,
    band_hz: tuple[float, float] | None = None,
    quantities: Iterable[ComparedQuantity] = COMPARED,
) -> AnalysedRun:
    """Analyse a run, by default in the paper's envelope band, and read the compared `quantities`.

    The line of a roller fault is searched for at the order computed from the run (see `compute_line_order`).
    """
    order = compute_line_order(run, case.state, bearing)
    if case.state is Fault.ROLLER and order is not None:
        bearing = replace(bearing, orders=replace(bearing.orders, bsf=order / 2))
    analysis = analysis_once(recording_from_run(run), bearing, band_hz=band_hz)
    values = read_quantities(analysis, case.state, order, quantities)
    return AnalysedRun(case=case, run=run, analysis=analysis, values=values)


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
