"""What is compared between model and rig, as a table: a new compared quantity is a new row of `COMPARED`.

Amplitudes in m/s2 are compared in `srbval.path.amplitudes`, since they need the path to the sensor.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

from srbval.bearing import DEFECTS, RACE_DEFECTS, Fault
from srbval.comparison.budget import PRIOR, TOLERANCE, VERDICT
from srbval.comparison.comparison import (
    GRID,
    INPUTS,
    MOUNTING,
    RIG_READING,
    RIG_SPEED,
    QuantityValue,
    Row,
    comparison_row,
)
from srbval.comparison.vocabulary import Verdict
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.signal import LEAST_SNR, NORMAL_95

LEVEL_AXIS = "level over the first harmonic, dB"
_DB = 20 / math.log(10)

Read = Callable[[Analysis, Fault], QuantityValue | None]
# Effects of inputs and numerics on one quantity of one defect, by (defect, quantity): rows of the stored result
# ``inputs``, in the quantity's unit.
Effects = Mapping[tuple[str, str], Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class ComparedQuantity:
    """One row of `COMPARED`: how a quantity is read and compared, and how the report shows it.

    `name` may hold ``{line}`` for the fault's line. `kind` and `heading` name its bias and its column of the matrix;
    quantities of one `plot` share it and its `axis`. `read` gives the value of an analysis. `from_order` gives the
    value by the line's order of the shaft, which a run of the model knows free of a reading's noise. Errors are in
    per cent of the rig's value if `relative`, else model less rig in dB. A `yes_or_no` quantity compares whether either
    side shows something. An error surely below `margin` agrees.
    """

    kind: str
    name: str
    heading: str
    read: Read
    unit: str = "dB"
    from_order: Callable[[Fault, float, int], float] | None = None
    relative: bool = False
    yes_or_no: bool = False
    margin: float | None = None
    plot: str = "level"
    axis: str = LEVEL_AXIS

    def name_of(self, fault: Fault) -> str:
        """The quantity's name for a fault; a multiple of a line that is one itself reads ``2 x 2xBSF``."""
        line = fault.line or ""
        return self.name.replace("x{line}", " x {line}" if line[:1].isdigit() else "x{line}").format(line=line)


def cage_ratio(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """Cage speed over shaft speed by the line of a race's defect.

    Both race lines give it, BPFO = Z c and BPFI = Z (1 - c) in orders of the shaft with Z rollers. Slip lowers BPFO and
    raises BPFI, so their errors must not be averaged.
    """
    return _by_line(analysis, fault, cage_of) if fault in RACE_DEFECTS else None


def roller_line(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """The line of a roller's defect in orders of the shaft: the roller's own rotation, which the cage does not fix."""
    return _by_line(analysis, fault, order_of) if fault is Fault.ROLLER else None


def cage_of(fault: Fault, order: float, rolling_elements: int) -> float:
    """Cage ratio c of a race line's order: order / Z by BPFO, 1 - order / Z by BPFI."""
    return order / rolling_elements if fault is Fault.OUTER else 1 - order / rolling_elements


def order_of(_: Fault, order: float, __: int) -> float:
    """The order itself."""
    return order


def _by_line(analysis: Analysis, fault: Fault, value_of: Callable[[Fault, float, int], float]) -> QuantityValue | None:
    line, shaft_hz, rollers = analysis.line_of(fault), analysis.speed.value_hz, analysis.bearing.rolling_elements
    if line.found_hz is None or not line.depth:
        return None
    order, slower = line.found_hz / shaft_hz, 1 - analysis.speed.ci95_hz / shaft_hz
    value = value_of(fault, order, rollers)
    return QuantityValue(
        value=value,
        ci95=abs(value_of(fault, order + (line.ci95_hz or 0.0) / shaft_hz, rollers) - value),
        speed_ci95=abs(value_of(fault, order * slower, rollers) - value),
        present=line.detected,
        kinematic=value_of(fault, line.kinematic_hz / shaft_hz, rollers),
    )


def harmonic_level(number: int) -> Read:
    """Level of a harmonic over the first [dB]."""
    return lambda analysis, fault: _level(analysis, fault, (fault.line,), number)


def sideband_level(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """Mean level of the sidebands next to the line over it [dB]; None for a fault without sidebands."""
    if fault.sidebands is None:
        return None
    return _level(analysis, fault, (f"{fault.line}-{fault.sidebands}", f"{fault.line}+{fault.sidebands}"), 1)


def _level(analysis: Analysis, fault: Fault, names: tuple[str | None, ...], harmonic: int) -> QuantityValue | None:
    """Mean level of lines over the first harmonic [dB]; its interval is Rayleigh's scatter of an amplitude in noise.

    None if the lines are out of the record's reach.
    """
    first = analysis.line_of(fault)
    lines = [x for name in names for x in analysis.lines if (x.name, x.harmonic) == (name, harmonic) and x.depth]
    if first.found_hz is None or not first.depth or not lines:
        return None
    depth = sum(line.depth or 0.0 for line in lines) / len(lines)
    spread = math.hypot(*(_scatter_db(line) / len(lines) for line in lines), _scatter_db(first))
    least = max((line.depth or 0.0) * math.sqrt(LEAST_SNR / max(line.snr or 0.0, 0.5)) for line in lines)
    return QuantityValue(
        value=_DB * math.log(depth / first.depth),
        ci95=NORMAL_95 * spread,
        present=first.detected and all(line.detected for line in lines),
        least=_DB * math.log(least / first.depth),
    )


def _scatter_db(line: Line) -> float:
    """Standard error of a line's level [dB]: one over the root of twice its power over noise, at most one."""
    return _DB / math.sqrt(2 * max(line.snr or 0.0, 0.5))


CAGE_RATIO = ComparedQuantity(
    kind="cage ratio",
    name="cage ratio",
    heading="Cage ratio, %",
    read=cage_ratio,
    unit="1",
    from_order=cage_of,
    relative=True,
    margin=TOLERANCE.limit_pct,
    plot="cage",
    axis="cage ratio's deviation from kinematics, %",
)
ROLLER_LINE = ComparedQuantity(
    kind="roller line",
    name="{line}",
    heading="Roller's line, %",
    read=roller_line,
    unit="order",
    from_order=order_of,
    relative=True,
    margin=TOLERANCE.limit_pct,
    plot="roller",
    axis="roller line's deviation from kinematics, %",
)
HARMONIC = {
    number: ComparedQuantity(
        kind=f"harmonic {number}",
        name=f"{number}x{{line}}",
        heading=f"Harmonic {number}, dB",
        read=harmonic_level(number),
        margin=VERDICT.level_db,
    )
    for number in (2, 3, 4, 5)
}
PRESENCE = ComparedQuantity(
    kind="sideband presence",
    name="{line} sidebands: shown",
    heading="Sidebands, model / rig",
    read=sideband_level,
    unit="1: yes",
    yes_or_no=True,
    plot="",
    axis="",
)
SIDEBANDS = ComparedQuantity(
    kind="sideband level",
    name="{line} sidebands",
    heading="Sideband level, dB",
    read=sideband_level,
    margin=VERDICT.level_db,
)
COMPARED: tuple[ComparedQuantity, ...] = (CAGE_RATIO, ROLLER_LINE, *HARMONIC.values(), PRESENCE, SIDEBANDS)
FREQUENCIES = (CAGE_RATIO.kind, ROLLER_LINE.kind)


def effects_of(stored: Mapping[str, Any]) -> Effects:
    """Effects of inputs and numerics from the stored result ``inputs``; none without it."""
    return {(row["defect"], row["quantity"]): row for row in stored.get("effects", ())}


def compare(
    fault: Fault,
    rig: Analysis,
    model: Mapping[str, QuantityValue],
    effects: Effects,
    *,
    scene: str = "paper",
    used_for: str = "withheld",
) -> Iterator[Row]:
    """A `comparison_row` for every quantity of a fault that both sides have; none for a healthy bearing.

    `model` holds the quantities of the run by name, `scene` names its scene. `effects` were measured at one speed and
    load and are carried over. The mean over the inputs is compared, not the run at their nominal values.
    """
    record = rig.recording.file or rig.recording.name
    for row in COMPARED if fault in DEFECTS else ():
        name = row.name_of(fault)
        theirs, own, studied = model.get(name), row.read(rig, fault), effects.get((fault.value, name))
        if theirs is None or own is None:
            continue
        if studied is not None:
            theirs = replace(theirs, value=theirs.value + studied["shift"])
        made = _presence(theirs, own) if row.yes_or_no else _difference(row, theirs, own, studied)
        yield comparison_row(
            record=record,
            state=fault,
            kind=row.kind,
            quantity=name,
            unit=row.unit,
            scene=scene,
            used_for=used_for,
            margin=row.margin,
            **made,
        )


def _difference(
    row: ComparedQuantity, model: QuantityValue, rig: QuantityValue, studied: Mapping[str, Any] | None
) -> dict[str, Any]:
    """Model less rig; U of a relative quantity includes the rig's shaft speed, U of a level the sensor's mounting.

    One mounting cannot separate the mounting's effect on a level from the model's error.
    """
    scale = 100 / rig.value if row.relative else 1.0
    parts = {RIG_READING: scale * (rig.ci95 or 0.0)}
    parts |= {RIG_SPEED: scale * rig.speed_ci95} if row.relative else {MOUNTING: NORMAL_95 * PRIOR.mounting_db}
    if studied is not None:
        parts |= {INPUTS: scale * studied["inputs_ci95"], GRID: scale * studied["grid_ci95"]}
    error = scale * (model.value - rig.value)
    return {"model": model, "rig": rig, "error": error, "error_unit": "%" if row.relative else "dB", "parts": parts}


def _presence(model: QuantityValue, rig: QuantityValue) -> dict[str, Any]:
    """Yes or no on either side; they differ if the side without would have shown the other's level."""
    verdict = Verdict.NOT_RESOLVED
    if model.present != rig.present:
        shown, missing = (model, rig) if model.present else (rig, model)
        would_show = missing.least < shown.value - (shown.ci95 or 0.0)
        verdict = Verdict.DIFFERS if would_show else Verdict.INSUFFICIENT
    yes = {
        side: replace(value, value=float(value.present), ci95=0.0) for side, value in (("model", model), ("rig", rig))
    }
    error = yes["model"].value - yes["rig"].value
    return yes | {"error": error, "error_unit": "yes or no", "parts": {}, "verdict": verdict}


def values_of_model(analysis: Analysis, fault: Fault, order: float | None) -> dict[str, QuantityValue]:
    """Quantities of a run by name: as read, or by the line's `order` if the run knows it and the quantity takes it."""
    found = {}
    for row in COMPARED if fault in DEFECTS else ():
        read = row.read(analysis, fault)
        if read is not None and row.from_order is not None and order is not None:
            value = row.from_order(fault, order, analysis.bearing.rolling_elements)
            read = QuantityValue(value=value, kinematic=read.kinematic)
        if read is not None:
            found[row.name_of(fault)] = read
    return found
