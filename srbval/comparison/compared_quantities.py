"""What is compared between model and rig, as a table: a new compared quantity is a new row of `COMPARED`.

Amplitudes in m/s2 are compared apart, in `srbval.path.amplitudes`: they need the path to the sensor.
"""

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from srbval.bearing import DEFECTS, RACE_DEFECTS, Fault
from srbval.comparison.budget import PRIOR, TOLERANCE, VERDICT
from srbval.comparison.comparison import (
    MODEL_STARTS,
    MOUNTING,
    RIG_READING,
    RIG_SPEED,
    Comparison,
    ComparisonVerdict,
    QuantityValue,
)
from srbval.comparison.effects import INPUTS, DefectEffects, Sensitivity
from srbval.comparison.spectrum_shape import UNRELATED_DEG, angle_between, angle_within, halves_of, noise_about
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.signal import LEAST_SNR, NORMAL_95

LEVEL_AXIS = "level over the first harmonic, dB"
_DB = 20 / math.log(10)

Read = Callable[[Analysis, Fault], QuantityValue | None]


@dataclass(frozen=True, kw_only=True)
class ComparedQuantity:
    """One row of `COMPARED`: how a quantity is read and compared, and how the report shows it.

    `name` may hold ``{line}`` for the fault's. `kind` and `heading` are those of its bias and of its column of the
    matrix; quantities of one `plot` share it and its `axis`. `read` gives the value from an analysis, `from_order` from
    the line's order of the shaft, where the model's run itself knows that, free of a reading's noise. `compare` gives
    the fields of a `Comparison` that depend on how it is made, or None where it cannot be. Errors are in `error_unit`:
    per cent of the rig's value where `relative`, else model less rig. A `yes_or_no` quantity counts whether either side
    shows something. An error surely below `margin` agrees.
    """

    kind: str
    name: str
    heading: str
    read: Read
    compare: Callable[["ComparedQuantity", QuantityValue, QuantityValue, DefectEffects | None], dict[str, Any] | None]
    unit: str = "dB"
    error_unit: str = "dB"
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

    def error_per_unit(self, rig: QuantityValue) -> float:
        """What one of its unit is in `error_unit`."""
        return 100 / rig.value if self.relative else 1.0


def cage_ratio(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """Cage speed over shaft speed by the line of a race's defect.

    It is what both race lines tell, BPFO = Z c and BPFI = Z (1 - c) in orders: one that slip lowers is one that slip
    raises the other by, so that errors of lines must not be pooled.
    """
    return _by_line(analysis, fault, cage_of) if fault in RACE_DEFECTS else None


def roller_line(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """The line of a roller's defect in orders of the shaft: its own turning, which the cage does not settle."""
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
        line=line,
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


def spectrum_shape(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """Angle of the spectra of a record's halves with each other [degrees], see `srbval.comparison.spectrum_shape`."""
    halves = halves_of(analysis, fault)
    if halves is None:
        return None
    degrees, ci95 = angle_within(halves)
    related = degrees + ci95 < UNRELATED_DEG
    return QuantityValue(value=degrees, ci95=ci95, present=related, line=analysis.line_of(fault), halves=halves)


def _level(analysis: Analysis, fault: Fault, names: tuple[str | None, ...], harmonic: int) -> QuantityValue | None:
    """Mean level of lines over the first harmonic [dB]; Rayleigh's scatter of an amplitude in noise is its interval.

    None where they are out of the record's reach.
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
        first_ci95=NORMAL_95 * _scatter_db(first),
        present=first.detected and all(line.detected for line in lines),
        least=_DB * math.log(least / first.depth),
        line=first,
    )


def _scatter_db(line: Line) -> float:
    """Standard error of a line's level [dB]: one over the root of twice its power over noise, at most one."""
    return _DB / math.sqrt(2 * max(line.snr or 0.0, 0.5))


def difference(
    row: ComparedQuantity, model: QuantityValue, rig: QuantityValue, _: DefectEffects | None = None
) -> dict[str, Any]:
    """Model less rig; a relative quantity's with the uncertainty of the rig's shaft speed, a level's of its mounting.

    One mounting cannot tell what mounting the sensor does to a level from the model's error: it is in U.
    """
    scale = row.error_per_unit(rig)
    parts = {MODEL_STARTS: scale * (model.ci95 or 0.0), RIG_READING: scale * (rig.ci95 or 0.0)}
    parts |= {RIG_SPEED: scale * rig.speed_ci95} if row.relative else {MOUNTING: NORMAL_95 * PRIOR.mounting_db}
    return {"model": model, "rig": rig, "error": scale * (model.value - rig.value), "parts": parts}


def presence(
    _: ComparedQuantity, model: QuantityValue, rig: QuantityValue, __: DefectEffects | None = None
) -> dict[str, Any]:
    """Yes or no on either side. A difference counts where the side without would have shown the other's level."""
    verdict = ComparisonVerdict.UNDECIDED
    if model.present != rig.present:
        shown, missing = (model, rig) if model.present else (rig, model)
        would_show = missing.least < shown.value - (shown.ci95 or 0.0)
        verdict = ComparisonVerdict.RESOLVED if would_show else ComparisonVerdict.INSUFFICIENT
    yes = [replace(side, value=float(side.present)) for side in (model, rig)]
    error = yes[0].value - yes[1].value
    return {"model": yes[0], "rig": yes[1], "error": error, "parts": {}, "verdict_override": verdict}


def shape_angle(
    _: ComparedQuantity, model: QuantityValue, rig: QuantityValue, known: DefectEffects | None = None
) -> dict[str, Any] | None:
    """The model's angle with the record less the one that a right model expects, and the chance of so large a one.

    That is the angle of the record's halves with each other, and what inputs and noise add to it; the former alone
    where the latter are not known. None where the record's line was not detected.
    """
    if rig.halves is None or model.halves is None or rig.line is None or not rig.line.detected:
        return None
    (degrees, ci95), noise = angle_between(model.halves, rig.halves), noise_about(rig.line)
    angle = QuantityValue(value=degrees, ci95=ci95, line=model.line)
    null = None if known is None or noise is None else known.right_model_excess(*noise)
    off = degrees - rig.value
    if null is None:
        parts = {MODEL_STARTS: ci95, RIG_READING: rig.ci95 or 0.0}
        return {"model": angle, "rig": replace(rig, halves=None), "error": off, "parts": parts}
    p = float(1 + len(null) * (null >= off).mean()) / (len(null) + 1)
    expected, reading = float(null.mean()), NORMAL_95 * math.sqrt(null.var(axis=1).mean())
    return {
        "model": angle,
        "rig": replace(rig, value=rig.value + expected, ci95=reading, halves=None),
        "error": off - expected,
        "parts": {RIG_READING: reading, INPUTS: NORMAL_95 * float(null.mean(axis=1).std())},
        "verdict_override": (ComparisonVerdict.RESOLVED if p < VERDICT.false_resolved else ComparisonVerdict.UNDECIDED),
        "p": p,
    }


CAGE_RATIO = ComparedQuantity(
    kind="cage ratio", name="cage ratio", heading="Cage ratio, %", read=cage_ratio, compare=difference,
    unit="1", error_unit="%", from_order=cage_of, relative=True, margin=TOLERANCE.limit_pct,
    plot="cage", axis="cage ratio's deviation from kinematics, %",
)  # fmt: skip
ROLLER_LINE = ComparedQuantity(
    kind="roller line", name="{line}", heading="Roller's line, %", read=roller_line, compare=difference,
    unit="order", error_unit="%", from_order=order_of, relative=True, margin=TOLERANCE.limit_pct,
    plot="roller", axis="roller line's deviation from kinematics, %",
)  # fmt: skip
HARMONIC = {
    number: ComparedQuantity(
        kind=f"harmonic {number}", name=f"{number}x{{line}}", heading=f"Harmonic {number}, dB",
        read=harmonic_level(number), compare=difference, margin=VERDICT.level_db,
    )
    for number in (2, 3, 4, 5)
}  # fmt: skip
PRESENCE = ComparedQuantity(
    kind="sideband presence", name="{line} sidebands: shown", heading="Sidebands, model / rig", read=sideband_level,
    compare=presence, unit="1: yes", error_unit="yes or no", yes_or_no=True, plot="", axis="",
)  # fmt: skip
SIDEBANDS = ComparedQuantity(
    kind="sideband level", name="{line} sidebands", heading="Sideband level, dB", read=sideband_level,
    compare=difference, margin=VERDICT.level_db,
)  # fmt: skip
SHAPE = ComparedQuantity(
    kind="spectrum shape", name="spectrum shape", heading="Spectrum shape, degrees", read=spectrum_shape,
    compare=shape_angle, unit="degrees", error_unit="degrees", plot="shape",
    axis="angle with the rig's spectrum, degrees",
)  # fmt: skip
COMPARED: tuple[ComparedQuantity, ...] = (CAGE_RATIO, ROLLER_LINE, *HARMONIC.values(), PRESENCE, SIDEBANDS, SHAPE)
FREQUENCIES = (CAGE_RATIO.kind, ROLLER_LINE.kind)


def compare(
    fault: Fault,
    rig: Analysis,
    model: Mapping[str, QuantityValue],
    sensitivity: Sensitivity,
    *,
    scene: str = "paper",
    used_for: str = "withheld",
) -> tuple[Comparison, ...]:
    """Every quantity of a fault that both sides can show; none for a healthy bearing. `scene` names the model's.

    `model` are its values by name. `sensitivity` was measured at one speed and load and is carried over; the mean over
    the inputs is compared, not their nominal values' run.
    """
    record, known = rig.recording.file or rig.recording.name, sensitivity.of(fault)
    found = []
    for row in COMPARED if fault in DEFECTS else ():
        name = row.name_of(fault)
        theirs, own = model.get(name), row.read(rig, fault)
        if theirs is None or own is None:
            continue
        effects = None if known is None else known.of(name)
        if effects is not None:
            theirs = replace(theirs, value=theirs.value + effects.shift)
        made = row.compare(row, theirs, own, known)
        if made is None:
            continue
        if known is not None:
            studied = known.parts_ci95(name).items()
            made["parts"] |= {part: row.error_per_unit(own) * ci95 for part, ci95 in studied}
        found.append(
            Comparison(
                record=record, state=fault, kind=row.kind, quantity=name, unit=row.unit, error_unit=row.error_unit,
                scene=scene, used_for=used_for, margin=row.margin, **made,
            )
        )  # fmt: skip
    return tuple(found)


def values_of_model(analysis: Analysis, fault: Fault, order: float | None) -> dict[str, QuantityValue]:
    """Every quantity of a run by name, as read, or by the line's `order` where the run gives it and a row takes it."""
    found = {}
    for row in COMPARED if fault in DEFECTS else ():
        read = row.read(analysis, fault)
        if read is not None and row.from_order is not None and order is not None:
            value = row.from_order(fault, order, analysis.bearing.rolling_elements)
            read = QuantityValue(value=value, line=read.line, kinematic=read.kinematic)
        if read is not None:
            found[row.name_of(fault)] = read
    return found


def mean_of_starts(values: Sequence[Mapping[str, QuantityValue]]) -> dict[str, QuantityValue]:
    """Means over runs, with Student's interval; shown where most runs show it. One run keeps its reading's interval."""
    from scipy.special import stdtrit

    if len(values) < 2:
        return dict(values[0])
    found = {}
    for name in values[0]:
        own = [one[name] for one in values if name in one]
        if len(own) < len(values):
            continue
        numbers = [one.value for one in own]
        ci95 = float(stdtrit(len(own) - 1, 0.975)) * statistics.stdev(numbers) / math.sqrt(len(own))
        found[name] = replace(
            own[0], value=statistics.fmean(numbers), ci95=ci95, least=max(one.least for one in own),
            present=2 * sum(one.present for one in own) > len(own),
        )  # fmt: skip
    return found
