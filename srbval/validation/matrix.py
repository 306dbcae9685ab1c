"""The validation matrix: every registered record of the rig, one cell an operating point of Table 5."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from srbval.bearing import Bearing
from srbval.errors import SrbvalError
from srbval.models.run import Run
from srbval.recordings import State
from srbval.recordings.datasets.description import Grid, dataset
from srbval.recordings.registry import RegisteredRecording, load_entry
from srbval.recordings.registry.verbs import RIG_DATASETS
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.comparison import ComparisonVerdict, deviation_pct
from srbval.validation.fault_call import FaultCall, call_fault

# The line a cell is about; the healthy bearing's is its baseline, not a fault.
LINE_OF = {State.HEALTHY: "BPFO", State.OUTER: "BPFO", State.INNER: "BPFI", State.ROLLER: "2xBSF"}
NOT_DETECTED = "line not detected"

Point = tuple[State, float, float, float]  # state, radial kN, axial kN, nominal motor rpm
ModelRuns = Callable[[Sequence[Analysis]], Sequence[Run | str]]


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One record [kN, rpm, Hz, %], the line of its state, the model's beside it, and what may be said.

    `deviation_pct` is the rig's from kinematics at the measured speed, `error_pct` the model's from the rig,
    `uncertainty_pct` that of the comparison; `model_hz` is None where the model gives no such line or its run
    failed (`remark` says why). `call` is the fault call against the healthy record of the same point.
    """

    state: State
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    file: str
    shaft_rpm: float
    speed_ci95_rpm: float
    speed_source: str
    line: str
    kinematic_hz: float
    rig_hz: float | None
    rig_ci95_hz: float | None
    snr: float | None
    depth: float | None
    detected: bool
    deviation_pct: float | None
    deviation_ci95_pct: float | None
    model_hz: float | None
    error_pct: float | None
    uncertainty_pct: float | None
    verdict: str
    call: FaultCall
    remark: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        return dataclasses.asdict(self) | {"state": self.state.value, "call": self.call.to_dict()}


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """The cells there are data for, on the grid of Table 5; `unusable` are records with the reason."""

    grid: Grid
    cells: tuple[Cell, ...] = ()
    unusable: tuple[tuple[str, str], ...] = ()

    def at(self, point: Point) -> Cell | None:
        """The cell of one operating point, None where nothing was measured."""
        return next((c for c in self.cells if (c.state, c.radial_kn, c.axial_kn, c.nominal_rpm) == point), None)

    @property
    def size(self) -> int:
        """Operating points of the grid."""
        return len(self.grid.states) * len(self.grid.radial_kn) * len(self.grid.nominal_rpm)


def rig_grid() -> Grid:
    """The grid of Table 5."""
    grid = dataset(RIG_DATASETS[0]).grid
    assert grid is not None, "a test holds the rig's description to its grid"
    return grid


def build_matrix(
    registered: Sequence[RegisteredRecording],
    *,
    bearing: Bearing,
    model_runs: ModelRuns,
    model_uncertainty_pct: Mapping[str, float],
) -> Matrix:
    """Analyse one record an operating point (the longest) and hold the model's line beside it.

    `model_runs` gives the model's run at each analysis' own speed and load, or why there is none;
    `model_uncertainty_pct` what numerics and open inputs do to each line [%]. A record that cannot be analysed
    is listed with its reason and fills no cell.
    """
    chosen: dict[Point, RegisteredRecording] = {}
    for entry in registered:
        point = _point(entry)
        if point is not None and (entry.seconds or 0) > (chosen[point].seconds or 0 if point in chosen else 0):
            chosen[point] = entry
    analyses: dict[Point, Analysis] = {}
    unusable = []
    for point, entry in chosen.items():
        try:
            analyses[point] = analyse(load_entry(entry), bearing=bearing)
        except SrbvalError as error:
            unusable.append((entry.file, str(error)))
    ordered = sorted(analyses.items(), key=lambda item: item[0])
    runs = model_runs([analysis for _, analysis in ordered])
    cells = tuple(
        _cell(point, analysis, analyses.get((State.HEALTHY, *point[1:])), run, model_uncertainty_pct)
        for (point, analysis), run in zip(ordered, runs, strict=True)
    )
    return Matrix(grid=rig_grid(), cells=cells, unusable=tuple(unusable))


def _point(entry: RegisteredRecording) -> Point | None:
    if entry.state is None or entry.radial_kn is None or entry.nominal_rpm is None:
        return None
    return entry.state, entry.radial_kn, entry.axial_kn or 0.0, entry.nominal_rpm


def _cell(
    point: Point,
    analysis: Analysis,
    healthy: Analysis | None,
    run: Run | str,
    model_uncertainty_pct: Mapping[str, float],
) -> Cell:
    state, radial_kn, axial_kn, nominal_rpm = point
    line = analysis.line(LINE_OF[state])
    model_hz = None if isinstance(run, str) else _model_line_hz(run, line.name, analysis)
    error = uncertainty = None
    verdict = NOT_DETECTED
    if line.detected and line.found_hz is not None:
        verdict = ComparisonVerdict.INSUFFICIENT.value
        if model_hz is not None:
            error = deviation_pct(model_hz, line.found_hz)
            uncertainty = math.hypot(line.deviation_ci95_pct or 0.0, model_uncertainty_pct.get(line.name, 0.0))
            resolved = abs(error) > uncertainty
            verdict = (ComparisonVerdict.RESOLVED if resolved else ComparisonVerdict.NOT_RESOLVED).value
    return Cell(
        state=state,
        radial_kn=radial_kn,
        axial_kn=axial_kn,
        nominal_rpm=nominal_rpm,
        file=analysis.recording.file or analysis.recording.name,
        shaft_rpm=60 * analysis.speed.value_hz,
        speed_ci95_rpm=60 * analysis.speed.ci95_hz,
        speed_source=analysis.speed.source.value,
        line=line.name,
        kinematic_hz=line.kinematic_hz,
        rig_hz=line.found_hz,
        rig_ci95_hz=line.ci95_hz,
        snr=line.snr,
        depth=line.depth,
        detected=line.detected,
        deviation_pct=line.deviation_pct if line.detected else None,
        deviation_ci95_pct=line.deviation_ci95_pct if line.detected else None,
        model_hz=model_hz,
        error_pct=error,
        uncertainty_pct=uncertainty,
        verdict=verdict,
        call=call_fault(analysis, None if state is State.HEALTHY else healthy),
        remark=run if isinstance(run, str) else "",
    )


def _model_line_hz(run: Run, line: str, analysis: Analysis) -> float | None:
    """A race line of the run's mean cage speed, at the recording's shaft speed; the model's rollers are not read."""
    rollers, shaft_hz = analysis.bearing.rolling_elements, analysis.speed.value_hz
    ratio = {"BPFO": run.cage_ratio, "BPFI": 1 - run.cage_ratio}.get(line)
    return None if ratio is None else rollers * ratio * shaft_hz
