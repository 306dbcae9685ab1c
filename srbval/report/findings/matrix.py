"""The validation matrix: one record per operating point of Table 5, and every quantity of its fault compared.

Every registered record of the rig fills a row; there is no other list.
"""

import math
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from srbval.bearing import DEFECTS, Fault
from srbval.comparison.compared_quantities import FREQUENCIES, RACE_LINE
from srbval.comparison.comparison import Row, comparison_frame
from srbval.comparison.counterpart import AnalysedRun, run_counterpart
from srbval.comparison.vocabulary import Verdict
from srbval.diagnosis.baseline import compare_with_baseline
from srbval.errors import NumericsError
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis
from srbval.reading.lines import line_entry
from srbval.recordings.reading import N_PER_KN
from srbval.validation.compare import PAIR_KEYS
from srbval.validation.pairing import OperatingPoint
from srbval.validation.validate import PairReading

if TYPE_CHECKING:
    import pandas as pd

# Verdicts on records that have no comparison.
NOT_DETECTED, BASELINE = "line not detected", "baseline"
Sides = tuple[Analysis, AnalysedRun | str]  # rig and model of a record; a text is the reason why the run failed


@dataclass(frozen=True, kw_only=True, eq=False)
class Matrix:
    """The registered records of the rig, at most one for each operating point of Table 5.

    `records` has one row per record, with the columns of `matrix` in ``report.json``: `model_hz` is NaN if there is no
    run, for the reason in `remark`; `call` is the fault call against the healthy record of the same speed and load;
    `verdict` is that on the frequency. `comparisons` has one row per record and quantity, see `comparison_row`.
    `unusable` are files that could not be analysed, with the reason. `sides`: rig and model of the points asked for.
    """

    records: "pd.DataFrame"
    comparisons: "pd.DataFrame"
    unusable: tuple[tuple[str, str], ...] = ()
    sides: Mapping[OperatingPoint, Sides] = field(default_factory=dict)


class MatrixRows:
    """Collects the rows of the matrix from pairs as they are read; both sides are kept of the points `keep` alone."""

    def __init__(self, keep: Collection[OperatingPoint], progress: Progress = silent) -> None:
        self.sides: dict[OperatingPoint, Sides] = {}
        self._keep, self._progress = keep, progress
        self._healthy: dict[tuple[float, float, float], Analysis] = {}
        self._records: dict[OperatingPoint, Row] = {}
        self._comparisons: dict[OperatingPoint, list[Row]] = {}

    def add(self, one: PairReading) -> None:
        """Add a pair of the case of the rig; the healthy record of a speed and load comes before the others."""
        rig = one.sides["measured"].analyses[0]
        recording = rig.recording
        radial_kn, axial_kn = ((load or 0.0) / N_PER_KN for load in (recording.radial_n, recording.axial_n))
        point = OperatingPoint(one.state, radial_kn, axial_kn, recording.nominal_rpm or 0.0)
        if point.state is Fault.HEALTHY:
            self._healthy[point[1:]] = rig
        simulated = one.sides.get("simulated")
        model = one.problem if simulated is None else simulated.model
        if point in self._keep and point.state is Fault.HEALTHY:
            model = self._healthy_run(rig)
        shown = point.state in DEFECTS and rig.line_of(point.state).detected
        rows = one.rows if shown else ()
        self._comparisons[point] = [
            {key: value for key, value in row.items() if key not in PAIR_KEYS}
            for row in rows
            if row["kind"] != RACE_LINE.kind and not math.isnan(row["error"])
        ]
        order = model.line_order if isinstance(model, AnalysedRun) else None
        remark = model if isinstance(model, str) else ""
        self._records[point] = _record(
            point, rig, self._healthy.get(point[1:]), order, remark, self._comparisons[point]
        )
        if point in self._keep and model is not None:
            self.sides[point] = (rig, model)

    def _healthy_run(self, rig: Analysis) -> AnalysedRun | str:
        """Run of a healthy bearing, of which nothing is compared but which figures show, or why it failed."""
        try:
            return run_counterpart(rig, Fault.HEALTHY, progress=self._progress)
        except NumericsError as error:
            return str(error)

    def matrix(self, unusable: Iterable[tuple[str, str]] = ()) -> Matrix:
        """The matrix of all pairs added."""
        import pandas as pd

        points = sorted(self._records)
        return Matrix(
            records=pd.DataFrame([self._records[point] for point in points]),
            comparisons=comparison_frame(row for point in points for row in self._comparisons[point]),
            unusable=tuple(unusable),
            sides={point: self.sides[point] for point in points if point in self.sides},
        )


def _record(
    point: OperatingPoint,
    rig: Analysis,
    healthy: Analysis | None,
    order: float | None,
    remark: str,
    rows: Iterable[Row],
) -> Row:
    """The record's row of the matrix; its deviation from kinematics is None if its line is not detected."""
    faulty = point.state is not Fault.HEALTHY
    line = rig.line_of(point.state if faulty else Fault.OUTER)  # a healthy bearing's BPFO line is its baseline
    frequency = next((row for row in rows if row["kind"] in FREQUENCIES), None)
    verdict = BASELINE if not faulty else frequency["verdict"] if frequency else Verdict.INSUFFICIENT.value
    return {
        **point._asdict(),
        "state": point.state.value,
        "file": rig.recording.file or rig.recording.name,
        "shaft_rpm": 60 * rig.speed.value_hz,
        "speed_ci95_rpm": 60 * rig.speed.ci95_hz,
        "speed_source": rig.speed.source.value,
        **line_entry(line),
        "rig_hz": line.found_hz,
        "rig_ci95_hz": line.ci95_hz,
        "deviation_pct": line.deviation_pct if line.detected else None,
        "deviation_ci95_pct": line.deviation_ci95_pct if line.detected else None,
        "model_hz": rig.speed.value_hz * order if order else None,
        "error_pct": None if frequency is None else frequency["error"],
        "uncertainty_pct": None if frequency is None else frequency["uncertainty"],
        "verdict": verdict if line.detected else NOT_DETECTED,
        "call": compare_with_baseline(rig, healthy),
        "remark": remark,
        "cautions": rig.recording.cautions,
    }
