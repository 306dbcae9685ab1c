"""The validation matrix: every registered record of the rig, one cell per operating point of Table 5.

Every registered record fills a cell, and every cell of a fault compares every quantity; there is no other list.
"""

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Executor, ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.comparison.compared_quantities import FREQUENCIES, compare
from srbval.comparison.comparison import Comparison, ComparisonVerdict
from srbval.comparison.counterpart import AnalysedRun
from srbval.comparison.effects import Sensitivity
from srbval.diagnosis.baseline import BaselineComparison, compare_with_baseline
from srbval.errors import SrbvalError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import Line, line_entry
from srbval.recordings import ShaftSpeed
from srbval.recordings.datasets.description import OperatingGrid, dataset
from srbval.recordings.registry import RIG_DATASETS, RegisteredRecording, load_entry, unopened

# Verdicts of cells that hold no comparison.
NOT_DETECTED, BASELINE = "line not detected", "baseline"
Counterpart = Callable[[Analysis, Executor], AnalysedRun | str]  # made in that pool
Sides = tuple[Analysis, AnalysedRun | str]  # of a record; the model's is the reason where its run failed


class Point(NamedTuple):
    """An operating point of Table 5: state, loads [kN], nominal motor speed [rpm]."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float


@dataclass(frozen=True, kw_only=True)
class MatrixCell:
    """One record [kN, rpm]: its shaft speed, the line of its state, the fault call, and its rows of the comparison.

    `comparisons` hold every quantity of the fault that both sides show; `error_pct` and `uncertainty_pct` are those of
    the frequency. `model_hz` is the model's line at the same speed,
    None where the cell is no fault's or the model's run failed (`remark` says why). `call` is the fault call against
    the healthy record of the same point.
    """

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float
    file: str
    speed: ShaftSpeed
    line: Line
    model_hz: float | None
    call: BaselineComparison
    comparisons: tuple[Comparison, ...] = ()
    error_pct: float | None = None
    uncertainty_pct: float | None = None
    remark: str = ""
    cautions: tuple[str, ...] = ()

    @property
    def point(self) -> Point:
        """The cell's place in the matrix."""
        return Point(self.state, self.radial_kn, self.axial_kn, self.nominal_rpm)

    @property
    def shaft_rpm(self) -> float:
        """Mean shaft speed [rpm]."""
        return 60 * self.speed.value_hz

    @property
    def verdict(self) -> str:
        """What may be said of the model at this point."""
        if not self.line.detected:
            return NOT_DETECTED
        if self.state is Fault.HEALTHY:
            return BASELINE
        frequency = next((row for row in self.comparisons if row.kind in FREQUENCIES), None)
        return (ComparisonVerdict.INSUFFICIENT if frequency is None else frequency.verdict).value

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``; the deviation from kinematics is null where the line is not detected."""
        line, entry = self.line, vars(self) | line_entry(self.line)
        del entry["speed"]
        return entry | {
            "shaft_rpm": self.shaft_rpm,
            "speed_ci95_rpm": 60 * self.speed.ci95_hz,
            "speed_source": self.speed.source,
            "rig_hz": line.found_hz,
            "rig_ci95_hz": line.ci95_hz,
            "deviation_pct": line.deviation_pct if line.detected else None,
            "deviation_ci95_pct": line.deviation_ci95_pct if line.detected else None,
            "verdict": self.verdict,
        }


@dataclass(frozen=True, kw_only=True)
class Matrix:
    """The cells there are data for, on the grid of Table 5; `unusable` are records with the reason.

    `sides` are those of the cells that were asked for: those of a full grid would not fit into memory.
    """

    grid: OperatingGrid
    cells: tuple[MatrixCell, ...] = ()
    unusable: tuple[tuple[str, str], ...] = ()
    sides: Mapping[Point, Sides] = field(default_factory=dict)

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """The whole table: the rows of all cells."""
        return tuple(row for cell in self.cells for row in cell.comparisons)

    @property
    def size(self) -> int:
        """Operating points of the grid."""
        return len(self.grid.states) * len(self.grid.radial_kn) * len(self.grid.nominal_rpm)


def rig_grid() -> OperatingGrid:
    """The grid of Table 5."""
    grid = dataset(RIG_DATASETS[0]).grid
    assert grid is not None, "a test holds the rig's description to its grid"
    return grid


def build_matrix(
    registered: Sequence[RegisteredRecording],
    *,
    bearing: Bearing,
    counterpart: Counterpart,
    sensitivity: Sensitivity,
    keep_sides_of: Collection[Point] = (),
    jobs: int | None = None,
) -> Matrix:
    """Analyse one record per operating point (the longest) and compare the model with it, `jobs` at a time.

    `counterpart` runs the model at a record's own speed and load in the pool it is given, or says why it failed;
    `sensitivity` holds the effects of numerics and open inputs. Verdicts hold over all records together (Holm). A
    healthy bearing's line is its baseline, not a fault that the model has: nothing is run for it. A record that cannot
    be analysed is listed with its reason and fills no cell. Both sides of the points in `keep_sides_of` are returned in
    full, healthy ones' too.
    """
    chosen: dict[Point, RegisteredRecording] = {}
    for entry in registered:
        point = point_of(entry)
        if point is not None and (entry.seconds or 0) > (chosen[point].seconds or 0 if point in chosen else 0):
            chosen[point] = entry

    def compared(points: Sequence[Point], runs: Executor) -> list[tuple[Point, MatrixCell | str, Sides | None]]:
        """The records of one speed and load, the healthy one first: the others are compared with it."""
        healthy, found = None, []
        for point in sorted(points, key=lambda point: point.state is not Fault.HEALTHY):
            entry, sides = chosen[point], None
            try:
                rig = analyse(load_entry(entry), bearing=bearing)
                wanted = point in keep_sides_of
                model = counterpart(rig, runs) if wanted or point.state in DEFECTS else None
                used_for = "blind" if unopened(entry) else "withheld"
                cell: MatrixCell | str = _cell(point, rig, healthy, model, sensitivity, used_for)
            except SrbvalError as error:
                cell = str(error)
            else:
                healthy = rig if point.state is Fault.HEALTHY else healthy
                sides = (rig, model) if wanted and model is not None else None
            found.append((point, cell, sides))
        return found

    groups: dict[tuple[float, float, float], list[Point]] = {}
    for point in sorted(chosen, key=lambda point: point.nominal_rpm):  # slow shafts first: theirs are the longest runs
        groups.setdefault(point[1:], []).append(point)
    # Records wait for their runs; a pool of these alone keeps every core busy, whichever records they belong to.
    workers = jobs or os.cpu_count() or 1
    with ThreadPoolExecutor(workers) as runs, ThreadPoolExecutor(workers) as records:
        tasks = [records.submit(compared, points, runs) for points in groups.values()]
        try:
            results = sorted((one for task in tasks for one in task.result()), key=lambda one: one[0])
        except BaseException:
            for pool in (records, runs):
                pool.shutdown(wait=False, cancel_futures=True)
            raise
    cells = [cell for _, cell, _ in results if isinstance(cell, MatrixCell)]
    return Matrix(
        grid=rig_grid(),
        cells=tuple(cells),
        unusable=tuple((chosen[point].file, cell) for point, cell, _ in results if isinstance(cell, str)),
        sides={point: sides for point, _, sides in results if sides is not None},
    )


def point_of(entry: RegisteredRecording) -> Point | None:
    """The operating point of a record, None where one of state, load and speed is not known."""
    if entry.state is None or entry.radial_kn is None or entry.nominal_rpm is None:
        return None
    return Point(entry.state, entry.radial_kn, entry.axial_kn or 0.0, entry.nominal_rpm)


def _cell(
    point: Point,
    analysis: Analysis,
    healthy: Analysis | None,
    model: AnalysedRun | str | None,
    sensitivity: Sensitivity,
    used_for: str,
) -> MatrixCell:
    state = point.state
    # A healthy bearing's line is its baseline, not a fault.
    line = analysis.line_of(Fault.OUTER if state is Fault.HEALTHY else state)
    rows: tuple[Comparison, ...] = ()
    model_order = model.line_order if isinstance(model, AnalysedRun) else None
    if line.detected and isinstance(model, AnalysedRun):
        rows = compare(state, analysis, model.values, sensitivity, scene=model.case.base, used_for=used_for)
    frequency = next((row for row in rows if row.kind in FREQUENCIES), None)
    return MatrixCell(
        **point._asdict(),
        file=analysis.recording.file or analysis.recording.name,
        speed=analysis.speed,
        line=line,
        model_hz=analysis.speed.value_hz * model_order if model_order else None,
        call=compare_with_baseline(analysis, healthy),
        comparisons=rows,
        error_pct=None if frequency is None else frequency.error,
        uncertainty_pct=None if frequency is None else frequency.uncertainty,
        remark=model if isinstance(model, str) else "",
        cautions=analysis.recording.cautions,
    )
