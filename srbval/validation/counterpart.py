"""A recording's counterpart: a run of the model at the record's own speed and load, through the same chain."""

import dataclasses
import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import Bearing, Fault
from srbval.errors import SrbvalError
from srbval.models.run import Run
from srbval.progress import Progress, silent
from srbval.recordings import recording_from_run
from srbval.scene import paper_scene
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.simulation_cases import SimulationCase, run_cases

# Length of a run in shaft turns. At 858 rpm levels of runs begun differently differ by up to 1.9 dB after 14 turns,
# 2.2 after 29, 2.1 after 57 and 0.8 after 114, half of that below the fourth harmonic; what inputs leave open is 2 to
# 6 dB, and a rig record of 2 s holds 29.
TURNS = 30.0
# Rate at which the rollers' speeds are recorded, by fault: only the line of a roller's defect needs them.
DETAIL_HZ = {Fault.ROLLER: 1024.0}


@dataclass(frozen=True, kw_only=True, eq=False)
class AnalysedRun:
    """A run and its analysis; `line_order` is the defect's line in orders of the shaft by the run's own speeds.

    That is the cage's for a race, the defective roller's own turning for a roller; None without a defect.
    """

    case: SimulationCase
    run: Run
    analysis: Analysis
    line_order: float | None


def run_counterpart(rig: Analysis, *, progress: Progress = silent) -> AnalysedRun | str:
    """`TURNS` turns of the paper's scene at the recording's measured speed and its load, with the defect of its state.

    The reason where that failed.
    """
    recording, state = rig.recording, rig.recording.state or Fault.HEALTHY
    case = SimulationCase(
        id=f"counterpart-{recording.name}",
        purpose="at the recording's own speed and load",
        state=state,
        scene=paper_scene(
            duration_s=TURNS / rig.speed.value_hz,
            shaft_speed_rad_s=2 * math.pi * rig.speed.value_hz,
            load={"radial_n": recording.radial_n or 0.0, "axial_n": recording.axial_n or 0.0},
            defect={"kind": state},
            detail_rate_hz=DETAIL_HZ.get(state, 0.0),
        ),
    )
    try:
        return analyse_run(case, run_cases([case], jobs=1, progress=progress)[case.id], rig.bearing)
    except SrbvalError as error:
        return str(error)


def analyse_run(case: SimulationCase, run: Run, bearing: Bearing) -> AnalysedRun:
    """Analyse a run. A roller's line is searched about the roller's own rotation, which the contacts decide."""
    order = line_order(run, case.state, bearing)
    if case.state is Fault.ROLLER and order is not None:
        bearing = dataclasses.replace(bearing, orders=dataclasses.replace(bearing.orders, bsf=order / 2))
    return AnalysedRun(
        case=case, run=run, analysis=analyse(recording_from_run(run), bearing=bearing), line_order=order
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
