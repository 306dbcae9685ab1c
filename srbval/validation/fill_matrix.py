"""Fill the validation matrix: every record through the one chain, a model run for it, every quantity compared."""

import os
import threading
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from concurrent.futures import ThreadPoolExecutor

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.errors import SrbvalError
from srbval.recordings.registry import RegisteredRecording, load_entry
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.compared_quantities import compare
from srbval.validation.comparison import Comparison
from srbval.validation.counterpart import AnalysedRun
from srbval.validation.effects import Sensitivity
from srbval.validation.fault_call import call_fault
from srbval.validation.matrix import CellSides, Matrix, MatrixCell, Point, rig_grid

Counterpart = Callable[[Analysis], AnalysedRun | str]


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

    `counterpart` runs the model at a record's own speed and load, or says why it failed; `sensitivity` holds the
    effects of numerics and open inputs. A healthy bearing's line is its baseline, not a fault that the model has:
    nothing is run for it. A record that cannot be analysed is listed with its reason and fills no cell. Both sides of
    the points in `keep_sides_of` are returned in full, healthy ones' too.
    """
    chosen: dict[Point, RegisteredRecording] = {}
    for entry in registered:
        point = point_of(entry)
        if point is not None and (entry.seconds or 0) > (chosen[point].seconds or 0 if point in chosen else 0):
            chosen[point] = entry
    # Slow shafts first: theirs are the longest runs. Records of one point follow each other.
    ordered = sorted(chosen.items(), key=lambda item: (item[0].nominal_rpm, item[0][1:3], item[0].state))
    baselines = {
        place: _Baseline(chosen.get(Point(Fault.HEALTHY, *place)), users, bearing)
        for place, users in Counter(point[1:] for point in chosen).items()
    }

    def one(item: tuple[Point, RegisteredRecording]) -> tuple[Point, MatrixCell | str, CellSides | None]:
        point, entry = item
        baseline = baselines[point[1:]]
        try:
            rig = baseline.analysis() if point.state is Fault.HEALTHY else analyse(load_entry(entry), bearing=bearing)
            assert rig is not None, "the point's healthy record is this one"
            wanted = point in keep_sides_of
            model = counterpart(rig) if wanted or point.state in DEFECTS else None
            cell = _cell(point, rig, baseline.usable_analysis(), model, sensitivity)
        except SrbvalError as error:
            return point, str(error), None
        finally:
            baseline.release()
        return point, cell, CellSides(rig=rig, model=model) if wanted and model is not None else None

    with ThreadPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
        results = sorted(pool.map(one, ordered), key=lambda result: result[0])
    return Matrix(
        grid=rig_grid(),
        cells=tuple(cell for _, cell, _ in results if isinstance(cell, MatrixCell)),
        unusable=tuple((chosen[point].file, why) for point, why, _ in results if isinstance(why, str)),
        sides={point: sides for point, _, sides in results if sides is not None},
    )


class _Baseline:
    """The healthy record of one operating point: analysed once, released after the point's last record."""

    def __init__(self, entry: RegisteredRecording | None, users: int, bearing: Bearing) -> None:
        self._entry, self._users, self._bearing = entry, users, bearing
        self._lock = threading.Lock()
        self._analysis: Analysis | None = None

    def analysis(self) -> Analysis | None:
        """Its analysis, None where no healthy record is registered; raises what `analyse` raises."""
        with self._lock:
            if self._analysis is None and self._entry is not None:
                self._analysis = analyse(load_entry(self._entry), bearing=self._bearing)
            return self._analysis

    def usable_analysis(self) -> Analysis | None:
        """The same, None too for a record that cannot be analysed: it is listed by itself."""
        try:
            return self.analysis()
        except SrbvalError:
            return None

    def release(self) -> None:
        """One user less; the last one frees the analysis."""
        with self._lock:
            self._users -= 1
            if not self._users:
                self._analysis = None


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
) -> MatrixCell:
    state = point.state
    # A healthy bearing's line is its baseline, not a fault.
    line = analysis.line_of(Fault.OUTER if state is Fault.HEALTHY else state)
    rows: tuple[Comparison, ...] = ()
    model_order = model.line_order if isinstance(model, AnalysedRun) else None
    if line.detected and isinstance(model, AnalysedRun):
        rows = compare(state, analysis, model.analysis, sensitivity, model_order=model_order)
    return MatrixCell(
        **point._asdict(),
        file=analysis.recording.file or analysis.recording.name,
        speed=analysis.speed,
        line=line,
        model_hz=analysis.speed.value_hz * model_order if model_order else None,
        call=call_fault(analysis, None if state is Fault.HEALTHY else healthy),
        comparisons=rows,
        remark=model if isinstance(model, str) else "",
    )
