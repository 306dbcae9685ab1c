"""Runs of the model that are compared: any cases side by side, and each recording's counterpart.

A counterpart is the model at the record's own speed and load, with enough points on a circle, from several starts.
"""

import dataclasses
import hashlib
import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from srbval.bearing import Bearing, Fault
from srbval.comparison.compared_quantities import mean_of_starts, values_of_model
from srbval.comparison.comparison import QuantityValue
from srbval.errors import SrbvalError
from srbval.models.run import Run
from srbval.models.run_file import scene_content
from srbval.models.simulate import Step, run_content, simulate, stored_run
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import recording_from_run
from srbval.scene import Scene, paper_scene
from srbval.storage.content_store import ContentStore, is_fresh
from srbval.storage.stored_result import StoredResult
from srbval.sweep.pool import side_by_side

PAPER_STATES = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
# Length of a run [shaft turns], and the most of it [s]: that of the rig's records, which last 2 s at any speed.
TURNS, LONGEST_S = 30.0, 2.1
# Rate at which the rollers' speeds are recorded, by fault: only the line of a roller's defect needs them.
DETAIL_HZ = {Fault.ROLLER: 1024.0}
# Points on a circle from which on levels change by less than 0.1 dB and runs no longer hang on their start; the paper's
# 500 are its own choice, see `srbval study run sensitivity`.
CONVERGED_POINTS = 2000
# Loads of the starts differ by up to this share: a change that no quantity may hang on, but a chaotic run does.
STARTS, START_SHARE = 8, 1e-5
VALUES = ContentStore(kind="start", computed_by=__name__)  # of further starts, what `mean_of_starts` takes of them
COUNTERPARTS = "counterparts"  # the study that stores those of the records that come with the program
TAKEN = ("value", "least", "present")  # of a `QuantityValue`; what is not finite is left out, as JSON has none
StartValues = Mapping[str, Mapping[str, Any]]
Starts = Mapping[str, StartValues]  # by `start_key`
NO_STARTS: Starts = {}


@dataclass(frozen=True, kw_only=True)
class SimulationCase:
    """One run: its id, what it is for, the state it simulates, its scene and the bundled one that this changes."""

    id: str
    purpose: str
    state: Fault
    scene: Scene
    base: str = "paper"


@dataclass(frozen=True, kw_only=True, eq=False)
class AnalysedRun:
    """A run and its analysis; `line_order` is the defect's line in orders of the shaft by the run's own speeds.

    That is the cage's for a race, the defective roller's own turning for a roller; None without a defect. `values` are
    those of the compared quantities, means over all starts where there were several.
    """

    case: SimulationCase
    run: Run
    analysis: Analysis
    line_order: float | None
    values: Mapping[str, QuantityValue] = field(default_factory=dict)


def paper_cases(seconds: float) -> list[SimulationCase]:
    """The paper's scene (710 rpm, 124.8 kN), `seconds` long: healthy, defect on the outer and on the inner race."""
    return [
        SimulationCase(
            id=f"paper-{state}", purpose="the paper's scene", state=state,
            scene=paper_scene(duration_s=seconds, defect={"kind": state}),
        )
        for state in PAPER_STATES
    ]  # fmt: skip


def run_case(
    case: SimulationCase, *, step: Step = Step.CHECKED, store: bool = True, progress: Progress = silent
) -> Run:
    """One run, see `stored_run`; `progress` gets it as a task. A failed one is a `NumericsError` naming it."""
    make = stored_run if store else simulate
    run = make(case.scene, step=step, progress=lambda task, fraction: progress(f"{task} {case.id}", fraction))
    return run.require_usable(f"case {case.id}: run")


def run_cases(
    cases: Sequence[SimulationCase], *, jobs: int | None = None, progress: Progress = silent
) -> dict[str, Run]:
    """Run all `cases`, see `side_by_side`; runs by the cases' ids. The first failed one is a `NumericsError`."""
    by_id = {case.id: case for case in cases}
    scenes = {case.id: case.scene for case in cases}
    return side_by_side(
        scenes, lambda key, report: run_case(by_id[key], progress=report), task="Simulate", jobs=jobs, progress=progress
    )


def with_points(scene: Scene, points: int) -> Scene:
    """The scene with so many points on a circle, the circle's stiffness and damping and the defect's length held."""
    factor = points / scene.contact.points_per_circle
    contact = dataclasses.replace(
        scene.contact, points_per_circle=points, stiffness_n_m=scene.contact.stiffness_n_m / factor,
        damping_ns_m=scene.contact.damping_ns_m / factor,
    )  # fmt: skip
    in_points = scene.defect.extent_m is None
    defect = dataclasses.replace(scene.defect, points=max(1, round(scene.defect.points * (factor if in_points else 1))))
    return dataclasses.replace(scene, contact=contact, defect=defect)


def converged(scene: Scene) -> Scene:
    """The scene with points enough; unchanged where it has them, or where its model has none."""
    coarse = scene.model == "full" and scene.contact.points_per_circle < CONVERGED_POINTS
    return with_points(scene, CONVERGED_POINTS) if coarse else scene


def load_ensemble(scene: Scene) -> tuple[Scene, ...]:
    """The scene at `STARTS` loads within a relative `START_SHARE` of its own: starts of an ensemble."""
    return tuple(
        dataclasses.replace(scene, load=dataclasses.replace(scene.load, radial_n=scene.load.radial_n * (1 + change)))
        for change in np.linspace(-START_SHARE, START_SHARE, STARTS).tolist()
    )


def counterpart_cases(rig: Analysis) -> list[SimulationCase]:
    """`TURNS` turns, at most `LONGEST_S`, of the paper's scene at the recording's own speed and load, with its defect.

    At converged points; one case for a healthy bearing, `STARTS` with a defect. The speed is rounded so that the last
    digits of its reading, which differ between machines, do not make another scene.
    """
    recording, state = rig.recording, rig.recording.state or Fault.HEALTHY
    shaft_hz = round(rig.speed.value_hz, 6)
    scene = converged(
        paper_scene(
            duration_s=min(TURNS / shaft_hz, LONGEST_S),
            shaft_speed_rad_s=2 * math.pi * shaft_hz,
            load={"radial_n": recording.radial_n or 0.0, "axial_n": recording.axial_n or 0.0},
            defect={"kind": state},
            detail_rate_hz=DETAIL_HZ.get(state, 0.0),
        )
    )
    return [
        SimulationCase(
            id=f"counterpart-{recording.name}" + f"-{number}" * (number > 1),
            purpose="at the recording's own speed and load",
            state=state,
            scene=one,
        )
        for number, one in enumerate((scene,) if state is Fault.HEALTHY else load_ensemble(scene), start=1)
    ]


def start_key(case: SimulationCase, bearing: Bearing) -> str:
    """Hash of what the values of a start follow from but for the code, 32 hexadecimal digits."""
    return hashlib.sha256(f"{scene_content(case.scene)} {case.state} {bearing}".encode()).hexdigest()[:32]


def start_values(
    case: SimulationCase, bearing: Bearing, *, stored: Starts = NO_STARTS, progress: Progress = silent
) -> StartValues:
    """What `mean_of_starts` takes of a further start, by quantity, as fields of a `QuantityValue`.

    Read from the `stored` ones, by `start_key`, or the cache; simulated where neither has them.
    """
    key = start_key(case, bearing)
    content = f"{run_content(case.scene)} {key}"
    found = stored.get(key) or VALUES.load(content, dict)
    if found is None:
        run = run_case(case, step=Step.UNCHECKED, store=False, progress=progress)
        read = analyse_run(case, run, bearing).values
        found = {name: {key: x for key in TAKEN if math.isfinite(x := getattr(one, key))} for name, one in read.items()}
        VALUES.save(content, found)
    return found


def stored_starts(result: StoredResult | None) -> Starts:
    """Values of starts that a study stored; none where they no longer hold, or everything is to be computed again."""
    return NO_STARTS if result is None or result.stale or is_fresh() else result.content["starts"]


def run_counterpart(
    rig: Analysis, *, pool: Executor, stored: Starts = NO_STARTS, progress: Progress = silent
) -> AnalysedRun | str:
    """The first of the `counterpart_cases`, its values means over all of them; the reason where one failed.

    The runs are made in `pool`, those of which `stored` holds the values not at all. The error of the step is estimated
    for the first alone, since all have the same step.
    """

    def shown(case: SimulationCase) -> AnalysedRun:
        return analyse_run(case, run_case(case, progress=progress), rig.bearing)

    case, *others = counterpart_cases(rig)
    first = pool.submit(shown, case)
    further = [pool.submit(start_values, one, rig.bearing, stored=stored, progress=progress) for one in others]
    try:
        run = first.result()
        starts = [{name: QuantityValue(**value) for name, value in one.result().items()} for one in further]
        return dataclasses.replace(run, values=mean_of_starts([run.values, *starts]))
    except SrbvalError as error:
        return str(error)
    finally:
        for future in further:
            future.cancel()


def analyse_run(
    case: SimulationCase, run: Run, bearing: Bearing, band_hz: tuple[float, float] | None = None
) -> AnalysedRun:
    """Read the run, in the paper's band unless one is given. A roller's line is looked for about its own turning."""
    order = line_order(run, case.state, bearing)
    if case.state is Fault.ROLLER and order is not None:
        bearing = dataclasses.replace(bearing, orders=dataclasses.replace(bearing.orders, bsf=order / 2))
    analysis = analyse(recording_from_run(run), bearing=bearing, band_hz=band_hz)
    return AnalysedRun(
        case=case, run=run, analysis=analysis, line_order=order, values=values_of_model(analysis, case.state, order)
    )  # fmt: skip


def line_order(run: Run, state: Fault, bearing: Bearing) -> float | None:
    """The line of `state` in orders of the shaft, by the run's mean speeds of cage or roller; None for a healthy one.

    A defect on a roller strikes both races once per revolution of the roller relative to its slot, which turns with the
    cage and is inclined by the bearing's tilt. None too where the run recorded no roller speeds.
    """
    if state is not Fault.ROLLER:
        return state.passing_order(run.rolling_elements, run.cage_ratio)
    if not run.spin_rad_s.size or bearing.geometry is None:
        return None
    defect = run.scene.defect
    spin = run.spin_rad_s[:, (defect.row - 1) * run.rolling_elements + defect.roller - 1]
    slot = run.cage_ratio * math.cos(bearing.geometry.tilt_rad)
    return 2 * abs(float(np.mean(spin)) / run.scene.shaft_speed_rad_s - slot)
