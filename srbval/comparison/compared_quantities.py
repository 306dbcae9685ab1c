"""What is compared between model and rig, as a table: a new compared quantity is a new row of `COMPARED`.

Amplitudes in m/s2 are compared apart, in `amplitudes`: they need the path to the sensor.
"""

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

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
from srbval.comparison.effects import GRID, INPUTS, DefectEffects, Sensitivity
from srbval.comparison.spectrum_shape import angle_between, angle_within, halves_of, noise_about
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.signal import LEAST_SNR, NORMAL_95

Read = Callable[[Analysis, Fault], QuantityValue | None]

_DB = 20 / math.log(10)


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of quantity: one bias and one scatter, one column of the matrix, and the plot it is drawn in.

    Errors of a `relative` kind are per cent of the rig's value, those of the others differences; `yes_or_no` kinds
    count whether or not both sides show something. Kinds of one `plot` (its name) share it and its `axis`. A kind is
    judged with its record's others where it is `primary`; a model whose error is surely below `margin` agrees.
    """

    name: str
    heading: str
    error_unit: str
    relative: bool = False
    yes_or_no: bool = False
    plot: str = ""
    axis: str = ""
    primary: bool = False
    margin: float | None = None


LEVEL_AXIS = "level over the first harmonic, dB"
CAGE_RATIO = Kind(
    name="cage ratio", heading="Cage ratio, %", error_unit="%", relative=True,
    plot="cage", axis="cage ratio's deviation from kinematics, %", primary=True, margin=TOLERANCE.limit_pct,
)  # fmt: skip
ROLLER_LINE = Kind(
    name="roller line", heading="Roller's line, %", error_unit="%", relative=True,
    plot="roller", axis="roller line's deviation from kinematics, %", primary=True, margin=TOLERANCE.limit_pct,
)  # fmt: skip
HARMONIC = {
    number: Kind(
        name=f"harmonic {number}",
        heading=f"Harmonic {number}, dB",
        error_unit="dB",
        plot="level",
        axis=LEVEL_AXIS,
        primary=number < 5,
        margin=VERDICT.level_db,
    )
    for number in (2, 3, 4, 5)
}
PRESENCE = Kind(
    name="sideband presence", heading="Sidebands, model / rig", error_unit="yes or no", yes_or_no=True
)  # fmt: skip
SIDEBANDS = Kind(
    name="sideband level", heading="Sideband level, dB", error_unit="dB", plot="level", axis=LEVEL_AXIS,
    primary=True, margin=VERDICT.level_db,
)  # fmt: skip
SHAPE = Kind(
    name="spectrum shape", heading="Spectrum shape, degrees", error_unit="degrees",
    plot="shape", axis="angle with the rig's spectrum, degrees",
)  # fmt: skip


class Sides(NamedTuple):
    """Both sides' values of one quantity, 95 % half widths of what numerics and inputs do to it, in its unit, and what
    else is `known` of the defect's effects.
    """

    kind: Kind
    model: QuantityValue
    rig: QuantityValue
    effects: Mapping[str, float]
    known: DefectEffects | None = None


class Outcome(NamedTuple):
    """The fields of a `Comparison` that depend on how the sides are compared."""

    model: QuantityValue
    rig: QuantityValue
    error: float
    parts: Mapping[str, float]
    verdict_override: ComparisonVerdict | None = None
    p: float | None = None


@dataclass(frozen=True, kw_only=True)
class ComparedQuantity:
    """One row: the quantity's name (with ``{line}`` for the fault's), unit, how it is read and how it is compared.

    `effects` gives the 95 % half widths of what numerics and inputs do to it, in `unit`; `from_order` gives
    the value from the line's order, where the model's run itself knows that, free of a reading's noise.
    """

    kind: Kind
    name: str
    unit: str
    read: Read
    effects: Callable[[DefectEffects, str, QuantityValue], dict[str, float]]
    compare: Callable[[Sides], Outcome | None]
    from_order: Callable[[Fault, float, int], float] | None = None

    def name_of(self, fault: Fault) -> str:
        """The quantity's name for a fault; a multiple of a line that is one itself reads ``2 x 2xBSF``."""
        line = fault.line or ""
        return self.name.replace("x{line}", " x {line}" if line[:1].isdigit() else "x{line}").format(line=line)


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
    within = angle_within(halves)
    line = analysis.line_of(fault)
    return QuantityValue(value=within.degrees, ci95=within.ci95, present=within.related, line=line, halves=halves)


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


def own_effects(effects: DefectEffects, quantity: str, _: QuantityValue) -> dict[str, float]:
    """Half widths that were measured on this very quantity."""
    own = effects.of(quantity)
    return {} if own is None else {INPUTS: effects.inputs_ci95(quantity), GRID: own.grid_ci95}


def no_effects(*_: object) -> dict[str, float]:
    """For quantities without an uncertainty."""
    return {}


def difference(sides: Sides) -> Outcome:
    """Model less rig; relative kinds in per cent of the rig's value, and with the uncertainty of its shaft speed.

    What the sensor's mounting does to a level is not told from that of the model by one mounting: it is in U.
    """
    kind, model, rig, effects, _ = sides
    scale = 100 / rig.value if kind.relative else 1.0
    parts = {MODEL_STARTS: scale * (model.ci95 or 0.0), RIG_READING: scale * (rig.ci95 or 0.0)}
    parts |= {RIG_SPEED: scale * rig.speed_ci95} if kind.relative else {MOUNTING: NORMAL_95 * PRIOR.mounting_db}
    parts |= {term: scale * bound for term, bound in effects.items()}
    return Outcome(model, rig, scale * (model.value - rig.value), parts)


def presence(sides: Sides) -> Outcome:
    """Yes or no on either side. A difference counts where the side without would have shown the other's level."""
    both = (sides.model, sides.rig)
    missing = [quiet for quiet, other in (both, both[::-1]) if other.present and not quiet.present]
    if not missing:
        verdict = ComparisonVerdict.UNDECIDED
    else:
        shown = max(q.value - (q.ci95 or 0.0) for q in both if q.present)
        verdict = ComparisonVerdict.RESOLVED if missing[0].least < shown else ComparisonVerdict.INSUFFICIENT
    model, rig = (replace(side, value=float(side.present)) for side in both)
    return Outcome(model, rig, model.value - rig.value, {}, verdict)


def shape_angle(sides: Sides) -> Outcome | None:
    """The model's angle with the record less the one that a right model expects, and the chance of so large a one.

    That is the angle of the record's halves with each other, and what inputs and noise add to it; the former alone
    where the latter are not known. None where the record's line was not detected.
    """
    rig, model = sides.rig, sides.model
    if rig.halves is None or model.halves is None or rig.line is None or not rig.line.detected:
        return None
    between, noise = angle_between(model.halves, rig.halves), noise_about(rig.line)
    theirs = QuantityValue(value=between.degrees, ci95=between.ci95, line=model.line)
    null = None if sides.known is None or noise is None else sides.known.right_model_excess(*noise)
    if null is None:
        parts = {MODEL_STARTS: between.ci95, RIG_READING: rig.ci95 or 0.0}
        return Outcome(theirs, replace(rig, halves=None), between.degrees - rig.value, parts)
    off = between.degrees - rig.value
    p = float(1 + len(null) * (null >= off).mean()) / (len(null) + 1)
    reading = NORMAL_95 * math.sqrt(null.var(axis=1).mean())
    return Outcome(
        theirs,
        replace(rig, value=rig.value + float(null.mean()), ci95=reading, halves=None),
        off - float(null.mean()),
        {RIG_READING: reading, INPUTS: NORMAL_95 * float(null.mean(axis=1).std())},
        ComparisonVerdict.RESOLVED if p < VERDICT.false_resolved else ComparisonVerdict.UNDECIDED,
        p,
    )


COMPARED: tuple[ComparedQuantity, ...] = (
    ComparedQuantity(
        kind=CAGE_RATIO, name="cage ratio", unit="1",
        read=cage_ratio, effects=own_effects, compare=difference, from_order=cage_of,
    ),
    ComparedQuantity(
        kind=ROLLER_LINE, name="{line}", unit="order",
        read=roller_line, effects=own_effects, compare=difference, from_order=order_of,
    ),
    *(
        ComparedQuantity(
            kind=kind, name=f"{number}x{{line}}", unit="dB",
            read=harmonic_level(number), effects=own_effects, compare=difference,
        )
        for number, kind in HARMONIC.items()
    ),
    ComparedQuantity(
        kind=PRESENCE, name="{line} sidebands: shown", unit="1: yes",
        read=sideband_level, effects=no_effects, compare=presence,
    ),
    ComparedQuantity(
        kind=SIDEBANDS, name="{line} sidebands", unit="dB",
        read=sideband_level, effects=own_effects, compare=difference,
    ),
    ComparedQuantity(
        kind=SHAPE, name="spectrum shape", unit="degrees",
        read=spectrum_shape, effects=no_effects, compare=shape_angle,
    ),
)  # fmt: skip
KINDS: tuple[Kind, ...] = tuple(dict.fromkeys(row.kind for row in COMPARED))


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
        effects: dict[str, float] = {}
        if known is not None:
            effects = row.effects(known, name, own)
            shift = known.of(name)
            theirs = replace(theirs, value=theirs.value + (shift.shift if shift else 0.0))
        outcome = row.compare(Sides(row.kind, theirs, own, effects, known))
        if outcome is not None:
            found.append(
                Comparison(
                    kind=row.kind.name, fault=fault, quantity=name, unit=row.unit, error_unit=row.kind.error_unit,
                    record=record, scene=scene, margin=row.kind.margin, used_for=used_for, **outcome._asdict(),
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
