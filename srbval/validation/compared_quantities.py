"""What is compared between model and rig, as a table: a new compared quantity is a new row of `COMPARED`.

Amplitudes are not compared: neither the sensor's path nor the contact's damping is modelled.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

from srbval.bearing import DEFECTS, Fault
from srbval.signal import LEAST_SNR, NORMAL_95
from srbval.validation.analyse import Analysis
from srbval.validation.comparison import (
    MODEL_READING,
    RIG_READING,
    RIG_SPEED,
    Comparison,
    ComparisonVerdict,
    QuantityValue,
)
from srbval.validation.effects import Sensitivity
from srbval.validation.lines import Line
from srbval.validation.spectrum_shape import angle_between, angle_within, halves_of

Read = Callable[[Analysis, Fault], QuantityValue | None]

_DB = 20 / math.log(10)


@dataclass(frozen=True, kw_only=True)
class Kind:
    """A kind of quantity: one bias and one scatter, one column of the matrix, and the plot it is drawn in.

    Errors of a `relative` kind are per cent of the rig's value, those of the others differences; `yes_or_no` kinds
    count whether or not both sides show something. Kinds of one `plot` (its name) share it and its `axis`.
    """

    name: str
    heading: str
    error_unit: str
    relative: bool = False
    yes_or_no: bool = False
    plot: str = ""
    axis: str = ""


LEVEL_AXIS = "level over the first harmonic, dB"
FREQUENCY = Kind(
    name="line frequency", heading="Frequency, %", error_unit="%", relative=True,
    plot="order", axis="line's deviation from kinematics, %",
)  # fmt: skip
PATTERN = Kind(name="harmonic pattern", heading="Harmonics, dB", error_unit="dB", plot="level", axis=LEVEL_AXIS)
PRESENCE = Kind(
    name="sideband presence", heading="Sidebands, model / rig", error_unit="yes or no", yes_or_no=True
)  # fmt: skip
SIDEBANDS = Kind(name="sideband level", heading="Sideband level, dB", error_unit="dB", plot="level", axis=LEVEL_AXIS)
SHAPE = Kind(
    name="spectrum shape", heading="Spectrum shape, degrees", error_unit="degrees",
    plot="shape", axis="angle with the rig's spectrum, degrees",
)  # fmt: skip


class Sides(NamedTuple):
    """Both sides' values of one quantity, the 95 % bounds of what terms of numerics and inputs do to it, in its unit,
    and the 95 % half width of the record's shaft speed [%]."""

    kind: Kind
    model: QuantityValue
    rig: QuantityValue
    effects: Mapping[str, float]
    speed_pct: float


class Outcome(NamedTuple):
    """The fields of a `Comparison` that depend on how the sides are compared."""

    model: QuantityValue
    rig: QuantityValue
    error: float
    parts: Mapping[str, float]
    verdict_override: ComparisonVerdict | None = None


@dataclass(frozen=True, kw_only=True)
class ComparedQuantity:
    """One row: the quantity's name (with ``{line}`` for the fault's), unit, how it is read and how it is compared.

    `effects` gives the 95 % bounds of what each term of numerics and inputs does to it, in `unit`; `from_run` is
    set where the model's run itself gives the value, free of a reading's noise.
    """

    kind: Kind
    name: str
    unit: str
    read: Read
    effects: Callable[[Sensitivity, Fault, str, QuantityValue], dict[str, float]]
    compare: Callable[[Sides], Outcome | None]
    from_run: bool = False

    def name_of(self, fault: Fault) -> str:
        """The quantity's name for a fault; a multiple of a line that is one itself reads ``2 x 2xBSF``."""
        line = fault.line or ""
        return self.name.replace("x{line}", " x {line}" if line[:1].isdigit() else "x{line}").format(line=line)


def line_order(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """The fault's line in orders of the shaft."""
    line, shaft_hz = analysis.line_of(fault), analysis.speed.value_hz
    if line.found_hz is None or not line.depth:
        return None
    return QuantityValue(
        value=line.found_hz / shaft_hz, ci95=(line.ci95_hz or 0.0) / shaft_hz, present=line.detected, line=line
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
    """Angle of the spectra of a record's halves with each other [degrees], see `srbval.validation.spectrum_shape`."""
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
        present=first.detected and all(line.detected for line in lines),
        least=_DB * math.log(least / first.depth),
        line=first,
    )


def _scatter_db(line: Line) -> float:
    """Standard error of a line's level [dB]: one over the root of twice its power over noise, at most one."""
    return _DB / math.sqrt(2 * max(line.snr or 0.0, 0.5))


def own_effects(sensitivity: Sensitivity, fault: Fault, quantity: str, _: QuantityValue) -> dict[str, float]:
    """Bounds of the terms that were measured on this very quantity."""
    return {e.part: e.bound for e in sensitivity.effects if (e.defect, e.quantity) == (fault.value, quantity)}


def shape_effects(sensitivity: Sensitivity, fault: Fault, _: str, rig: QuantityValue) -> dict[str, float]:
    """What each term does to the model's angle with this very record; of an ensemble the largest counts."""
    bounds: dict[str, float] = {}
    for effect in sensitivity.shapes:
        if effect.defect == fault.value and rig.halves is not None:
            bounds[effect.part] = max(effect.bound_with(rig.halves), bounds.get(effect.part, 0.0))
    return bounds


def no_effects(*_: object) -> dict[str, float]:
    """For quantities without an uncertainty."""
    return {}


def difference(sides: Sides) -> Outcome:
    """Model less rig; relative kinds in per cent of the rig's value, and with the uncertainty of its shaft speed."""
    kind, model, rig, effects, speed_pct = sides
    scale = 100 / rig.value if kind.relative else 1.0
    parts = {MODEL_READING: scale * (model.ci95 or 0.0), RIG_READING: scale * (rig.ci95 or 0.0)}
    if kind.relative:
        parts[RIG_SPEED] = speed_pct
    parts |= {term: scale * bound for term, bound in effects.items()}
    return Outcome(model, rig, scale * (model.value - rig.value), parts)


def presence(sides: Sides) -> Outcome:
    """Yes or no on either side. A difference counts where the side without would have shown the other's level."""
    both = (sides.model, sides.rig)
    missing = [quiet for quiet, other in (both, both[::-1]) if other.present and not quiet.present]
    if not missing:
        verdict = ComparisonVerdict.NOT_RESOLVED
    else:
        shown = max(q.value - (q.ci95 or 0.0) for q in both if q.present)
        verdict = ComparisonVerdict.RESOLVED if missing[0].least < shown else ComparisonVerdict.INSUFFICIENT
    model, rig = (replace(side, value=float(side.present)) for side in both)
    return Outcome(model, rig, model.value - rig.value, {}, verdict)


def shape_angle(sides: Sides) -> Outcome | None:
    """The model's angle with the record less that of the record's halves with each other, the best there is.

    None where the record's line was not detected.
    """
    rig, model = sides.rig, sides.model
    if rig.halves is None or model.halves is None or rig.line is None or not rig.line.detected:
        return None
    between = angle_between(rig.halves, model.halves)
    parts = {MODEL_READING: between.ci95, RIG_READING: rig.ci95 or 0.0, **sides.effects}
    theirs = QuantityValue(value=between.degrees, ci95=between.ci95, line=model.line)
    return Outcome(theirs, replace(rig, halves=None), between.degrees - rig.value, parts)


COMPARED: tuple[ComparedQuantity, ...] = (
    ComparedQuantity(
        kind=FREQUENCY, name="{line}", unit="order",
        read=line_order, effects=own_effects, compare=difference, from_run=True,
    ),
    *(
        ComparedQuantity(
            kind=PATTERN, name=f"{number}x{{line}}", unit="dB",
            read=harmonic_level(number), effects=own_effects, compare=difference,
        )
        for number in (2, 3, 4, 5)
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
        read=spectrum_shape, effects=shape_effects, compare=shape_angle,
    ),
)  # fmt: skip
KINDS: tuple[Kind, ...] = tuple(dict.fromkeys(row.kind for row in COMPARED))


def compare(
    fault: Fault,
    rig: Analysis,
    model: Analysis,
    sensitivity: Sensitivity,
    *,
    model_order: float | None = None,
    scene: str = "paper",
) -> tuple[Comparison, ...]:
    """Every quantity of a fault that both sides can show; none for a healthy bearing. `scene` names the model's.

    `model_order` is the model's line in orders of the shaft where the run gives it without a reading (from the speed of
    its cage or its roller). `sensitivity` was measured at one speed and load and is carried over.
    """
    speed_pct = 100 * rig.speed.ci95_hz / rig.speed.value_hz
    record = rig.recording.file or rig.recording.name
    found = []
    for row in COMPARED if fault in DEFECTS else ():
        theirs, own = value_of_model(row, model, fault, model_order), row.read(rig, fault)
        if theirs is None or own is None:
            continue
        name = row.name_of(fault)
        effects = row.effects(sensitivity, fault, name, own)
        outcome = row.compare(Sides(row.kind, theirs, own, effects, speed_pct))
        if outcome is not None:
            found.append(
                Comparison(
                    kind=row.kind.name, fault=fault, quantity=name, unit=row.unit, error_unit=row.kind.error_unit,
                    record=record, scene=scene, **outcome._asdict(),
                )
            )  # fmt: skip
    return tuple(found)


def value_of_model(
    row: ComparedQuantity, analysis: Analysis, fault: Fault, order: float | None
) -> QuantityValue | None:
    """The model's value: as its run gives it where the row says so and the run does, else as read."""
    if row.from_run and order is not None:
        return QuantityValue(value=order, line=analysis.line_of(fault))
    return row.read(analysis, fault)
