"""The validation matrix: one record per operating point of Table 5, and every quantity of its fault compared.

Every registered record of the rig fills a row; there is no other list.
"""

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.comparison.compared_quantities import FREQUENCIES, Effects, compare
from srbval.comparison.comparison import Row, comparison_frame
from srbval.comparison.counterpart import AnalysedRun
from srbval.comparison.vocabulary import Verdict
from srbval.diagnosis.baseline import compare_with_baseline
from srbval.errors import SrbvalError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import line_entry
from srbval.recordings.registry import RegisteredRecording, load_entry, unopened

if TYPE_CHECKING:
    import pandas as pd

# Verdicts on records that have no comparison.
NOT_DETECTED, BASELINE = "line not detected", "baseline"
Counterpart = Callable[[Analysis], AnalysedRun | str]
Sides = tuple[Analysis, AnalysedRun | str]  # rig and model of a record; a text is the reason why the run failed


class Point(NamedTuple):
    """An operating point of Table 5: state, loads [kN], nominal motor speed [rpm]."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float


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
    sides: Mapping[Point, Sides] = field(default_factory=dict)


def build_matrix(
    registered: Sequence[RegisteredRecording],
    *,
    bearing: Bearing,
    counterpart: Counterpart,
    effects: Effects,
    keep_sides_of: Collection[Point] = (),
    jobs: int | None = None,
) -> Matrix:
    """Analyse one record per operating point (the longest) and compare the model with it, `jobs` at a time.

    `counterpart` runs the model at a record's own speed and load, or returns the reason why it failed; `effects` are
    those of numerics and uncertain inputs. Both sides of the points in `keep_sides_of` are returned; apart from these,
    nothing is run for a healthy bearing, whose line is a baseline and not a fault.
    """
    import pandas as pd

    chosen: dict[Point, RegisteredRecording] = {}
    for entry in registered:
        point = point_of(entry)
        if point is not None and (entry.seconds or 0) > (chosen[point].seconds or 0 if point in chosen else 0):
            chosen[point] = entry

    def sides_of(point: Point) -> tuple[Analysis, AnalysedRun | str | None] | str:
        try:
            rig = analyse(load_entry(chosen[point]), bearing=bearing)
            wanted = point in keep_sides_of or point.state in DEFECTS
            return rig, counterpart(rig) if wanted else None
        except SrbvalError as error:
            return str(error)

    groups: dict[tuple[float, float, float], list[Point]] = {}  # of one speed and load, the healthy record first
    for point in sorted(chosen, key=lambda point: (point.nominal_rpm, point.state is not Fault.HEALTHY)):
        groups.setdefault(point[1:], []).append(point)
    records, comparisons, sides, unusable = dict[Point, Row](), dict[Point, list[Row]](), dict[Point, Sides](), []
    with ThreadPoolExecutor(jobs or os.cpu_count() or 1) as pool:
        for points in groups.values():
            healthy = None
            for point, found in zip(points, pool.map(sides_of, points), strict=True):
                if isinstance(found, str):
                    unusable.append((chosen[point].file, found))
                    continue
                rig, model = found
                healthy = rig if point.state is Fault.HEALTHY else healthy
                used_for = "blind" if unopened(chosen[point]) else "withheld"
                shown = point.state in DEFECTS and rig.line_of(point.state).detected
                values = model.values if shown and isinstance(model, AnalysedRun) else {}
                comparisons[point] = list(compare(point.state, rig, values, effects, used_for=used_for))
                records[point] = _record(point, rig, healthy, model, comparisons[point])
                if model is not None and point in keep_sides_of:
                    sides[point] = (rig, model)
    ordered = sorted(records)
    return Matrix(
        records=pd.DataFrame([records[point] for point in ordered]),
        comparisons=comparison_frame(row for point in ordered for row in comparisons[point]),
        unusable=tuple(unusable),
        sides={point: sides[point] for point in ordered if point in sides},
    )


def point_of(entry: RegisteredRecording) -> Point | None:
    """The operating point of a record; None if one of state, load and speed is not known."""
    if entry.state is None or entry.radial_kn is None or entry.nominal_rpm is None:
        return None
    return Point(entry.state, entry.radial_kn, entry.axial_kn or 0.0, entry.nominal_rpm)


def _record(
    point: Point, rig: Analysis, healthy: Analysis | None, model: AnalysedRun | str | None, rows: Sequence[Row]
) -> Row:
    """The record's row of the matrix; its deviation from kinematics is None if its line is not detected."""
    faulty = point.state is not Fault.HEALTHY
    line = rig.line_of(point.state if faulty else Fault.OUTER)  # a healthy bearing's BPFO line is its baseline
    frequency = next((row for row in rows if row["kind"] in FREQUENCIES), None)
    verdict = BASELINE if not faulty else frequency["verdict"] if frequency else Verdict.INSUFFICIENT.value
    order = model.line_order if isinstance(model, AnalysedRun) else None
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
        "remark": model if isinstance(model, str) else "",
        "cautions": rig.recording.cautions,
    }
