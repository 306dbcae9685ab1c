"""Table 6: the paper's rows as data, compared with our model at the paper's speed and at the rig recordings' own."""

import enum
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.comparison import Comparison, QuantityValue, deviation_pct
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.reading.sum_rule import SumRule
from srbval.storage.tables import build, read_toml


@dataclass(frozen=True, kw_only=True)
class PrintedRow:
    """One row of Table 6: frequencies [Hz] and deviations as printed [%]."""

    defect: str
    line: str
    kinematic_hz: float
    model_hz: float
    model_printed_pct: float
    rig_hz: float
    rig_printed_pct: float


@dataclass(frozen=True, kw_only=True)
class Table6:
    """Table 6 with the speed and load it was taken at."""

    table: str
    shaft_rpm: float
    motor_rpm: int
    radial_kn: float
    row: tuple[PrintedRow, ...]

    def of(self, defect: str) -> PrintedRow:
        """The row of a defect (``outer`` or ``inner``)."""
        return next(row for row in self.row if row.defect == defect)


class RigSource(enum.StrEnum):
    """Where a rig value comes from."""

    MEASURED = "measured"
    PUBLISHED = "published"


@dataclass(frozen=True, kw_only=True)
class Table6Row:
    """A row of Table 6: our model's line against a rig's, frequencies [Hz] with deviations [%].

    The kinematic frequency is printed at the paper's speed, computed at the rig recordings'. `model_cage_hz` is the
    model's line by its mean cage speed; `printed` is the paper's own row, None for a measured recording.
    """

    comparison: Comparison
    rig_source: RigSource
    shaft_rpm: float
    model_cage_hz: float
    printed: PrintedRow | None = None

    @property
    def line(self) -> Line:
        """The rig's line."""
        line = self.comparison.rig.line
        assert line is not None, "a row is about a line"
        return line

    @property
    def model_deviation_pct(self) -> float:
        """Model from kinematic [%]."""
        return deviation_pct(self.comparison.model.value, self.line.kinematic_hz)

    @property
    def rig_deviation_pct(self) -> float:
        """Rig from kinematic [%]."""
        return deviation_pct(self.comparison.rig.value, self.line.kinematic_hz)

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``; `*_recomputed_pct` follow from the frequencies the paper prints."""
        made, printed, kinematic_hz = self.comparison, self.printed, self.line.kinematic_hz
        return {
            "defect": made.fault,
            "line": self.line.name,
            "shaft_rpm": self.shaft_rpm,
            "kinematic_hz": kinematic_hz,
            "model_hz": made.model.value,
            "model_ci95_hz": made.model.ci95,
            "model_cage_hz": self.model_cage_hz,
            "rig_hz": made.rig.value,
            "rig_source": self.rig_source,
            "rig_ci95_hz": made.rig.ci95,
            "rig_shaft_rpm": None if printed else self.shaft_rpm,
            "paper_model_hz": printed and printed.model_hz,
            "paper_rig_hz": printed and printed.rig_hz,
            "paper_model_printed_pct": printed and printed.model_printed_pct,
            "paper_rig_printed_pct": printed and printed.rig_printed_pct,
            "uncertainty_parts_pct": made.parts,
            "model_deviation_pct": self.model_deviation_pct,
            "rig_deviation_pct": self.rig_deviation_pct,
            "comparison_error_pct": made.error,
            "validation_uncertainty_pct": made.uncertainty,
            "paper_model_recomputed_pct": printed and deviation_pct(printed.model_hz, kinematic_hz),
            "paper_rig_recomputed_pct": printed and deviation_pct(printed.rig_hz, kinematic_hz),
            "verdict": made.verdict,
        }


def table6() -> Table6:
    """The paper's Table 6."""
    path = Path(str(resources.files("srbval.comparison") / "paper" / "table6.toml"))
    return build(Table6, read_toml(path), "table6.toml")


def line_comparison(
    fault: Fault, record: str, model: QuantityValue, rig: QuantityValue, parts: Mapping[str, float]
) -> Comparison:
    """The comparison of a line's frequencies [Hz]; parts of its uncertainty [%]."""
    return Comparison(
        kind=CAGE_RATIO.name,
        fault=fault,
        quantity=fault.line or "",
        unit="Hz",
        error_unit=CAGE_RATIO.error_unit,
        record=record,
        model=model,
        rig=rig,
        error=deviation_pct(model.value, rig.value),
        parts=parts,
    )


def published_rows(printed: Table6, paper: Mapping[Fault, Analysis], runs: Mapping[str, Run]) -> Iterator[Table6Row]:
    """Our model at the paper's speed with the paper's model and rig, and the printed kinematic frequency.

    The paper gives its rig values no uncertainty and no measured speed, so these rows cannot be resolved.
    """
    for fault in RACE_DEFECTS:
        row, (line, found_hz, ci95_hz) = printed.of(fault.value), found_line(paper[fault], fault)
        theirs = Line(name=row.line, harmonic=1, kinematic_hz=row.kinematic_hz, found_hz=row.rig_hz)
        model = QuantityValue(value=found_hz, ci95=ci95_hz, line=line)
        rig = QuantityValue(value=row.rig_hz, ci95=None, line=theirs)
        yield Table6Row(
            comparison=line_comparison(fault, printed.table, model, rig, {}),
            rig_source=RigSource.PUBLISHED,
            shaft_rpm=printed.shaft_rpm,
            model_cage_hz=cage_line_hz(runs[f"paper-{fault}"], fault),
            printed=row,
        )


def measured_rows(
    rig: Mapping[Fault, Analysis], runs: Mapping[Fault, Run], comparisons: Sequence[Comparison]
) -> Iterator[Table6Row]:
    """Our model compared with each recording at its measured speed; states without a found line are left out.

    The comparison of the cage ratio, said of the line: a per cent of c is c / (1 - c) per cent of BPFI.
    """
    for fault in RACE_DEFECTS:
        of_cage = [row for row in comparisons if (row.fault, row.kind) == (fault, CAGE_RATIO.name)]
        if fault not in rig or not of_cage:
            continue
        (line, found_hz, ci95_hz), speed = found_line(rig[fault], fault), rig[fault].speed
        c, outer = of_cage[0].model.value, fault is Fault.OUTER
        model_hz = rig[fault].bearing.rolling_elements * speed.value_hz * (c if outer else 1 - c)
        line_over_cage = 1.0 if outer else c / (1 - c)
        parts = {name: line_over_cage * part for name, part in of_cage[0].parts.items()}
        own = QuantityValue(value=found_hz, ci95=ci95_hz, line=line)
        recording = rig[fault].recording
        made = line_comparison(fault, recording.file or recording.name, QuantityValue(value=model_hz), own, parts)
        yield Table6Row(
            comparison=made,
            rig_source=RigSource.MEASURED,
            shaft_rpm=60 * speed.value_hz,
            model_cage_hz=cage_line_hz(runs[fault], fault),
        )


def sum_rules(
    printed: Table6, paper: Mapping[Fault, Analysis], runs: Mapping[str, Run], rig: Mapping[Fault, Analysis]
) -> Iterator[SumRule]:
    """BPFO + BPFI of every pair there is: printed kinematic, paper's model, paper's rig, our model, the recordings.

    Our model's two runs have their own mean cage speeds, which are known; the rig's are not.
    """
    outer, inner = printed.of("outer"), printed.of("inner")
    shaft_hz = printed.shaft_rpm / 60
    rollers = paper[Fault.OUTER].bearing.rolling_elements
    for source, origin, bpfo, bpfi in (
        ("kinematic, as printed", "published", outer.kinematic_hz, inner.kinematic_hz),
        ("paper's model", "published", outer.model_hz, inner.model_hz),
        ("paper's rig", "published", outer.rig_hz, inner.rig_hz),
    ):
        yield SumRule(
            source=source, origin=origin, rolling_elements=rollers,
            bpfo_order=bpfo / shaft_hz, bpfi_order=bpfi / shaft_hz, ci95=None, stated_rpm=60 * shaft_hz,
        )  # fmt: skip
    cage = {state: runs[f"paper-{state}"].cage_ratio for state in RACE_DEFECTS}
    slip = rollers * (cage[Fault.OUTER] - cage[Fault.INNER])
    yield _read_pair("our model, two runs", "simulated", rollers, paper, slip)
    if all(s in rig and found_line(rig[s], s)[0].detected for s in RACE_DEFECTS):
        rpm = rig[Fault.OUTER].recording.nominal_rpm
        yield _read_pair(f"rig recordings, {rpm:g} rpm nominal", "measured", rollers, rig)


def found_line(analysis: Analysis, fault: Fault) -> tuple[Line, float, float]:
    """First harmonic of a line, its frequency and 95 % half width [Hz]; `DataError` outside the record's reach."""
    line = analysis.line_of(fault)
    if line.found_hz is None:
        raise DataError(f"{analysis.recording.name}: {fault.line} cannot be read; the record is too short.")
    return line, line.found_hz, line.ci95_hz or 0.0


def cage_line_hz(run: Run, fault: Fault) -> float:
    """A race line from the run's own mean cage speed [Hz]."""
    return run.bpfo_hz if fault is Fault.OUTER else run.bpfi_hz


def _read_pair(
    source: str, origin: str, rollers: int, sides: Mapping[Fault, Analysis], slip_difference: float = 0.0
) -> SumRule:
    orders, ci95 = [], []
    for fault in (Fault.OUTER, Fault.INNER):
        (_, found_hz, ci95_hz), speed = found_line(sides[fault], fault), sides[fault].speed
        orders.append(found_hz / speed.value_hz)
        relative = math.hypot(ci95_hz / found_hz, speed.ci95_hz / speed.value_hz)
        ci95.append(relative * found_hz / speed.value_hz)
    shaft_hz = (sides[Fault.OUTER].speed.value_hz + sides[Fault.INNER].speed.value_hz) / 2
    return SumRule(
        source=source, origin=origin, rolling_elements=rollers, bpfo_order=orders[0], bpfi_order=orders[1],
        ci95=math.hypot(*ci95), stated_rpm=60 * shaft_hz, slip_difference=slip_difference,
    )  # fmt: skip
