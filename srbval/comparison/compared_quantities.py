"""Quantities that are compared between model and rig (table `COMPARED`), and the model's mean errors (biases).

Amplitudes in m/s2 are not among them: they depend on the path to the sensor (`srbval.path.amplitudes`). A kind of
quantity, such as all levels of second harmonics, has one bias; theory: "Bias and scatter". If a record has several
errors of the kind, their mean is used, since they share bearing, mounting and speed.
"""

import math
from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import pandas as pd
from scipy.special import stdtrit

from srbval.bearing import DEFECTS, RACE_DEFECTS, Fault
from srbval.comparison.comparison import TOLERANCE, VERDICT, QuantityValue, Row
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.signal import NORMAL_95

_DB = 20 / math.log(10)
MIN_RECORDS_FOR_BIAS = 5

ValueOfOrder = Callable[[Fault, float, int], float]  # of fault, order of its line, rolling elements
# Effects of inputs and numerics on one quantity of one defect, by (defect, quantity): rows of the stored result
# ``inputs``, in the quantity's unit.
Effects = Mapping[tuple[str, str], Mapping[str, Any]]


@dataclass(frozen=True, kw_only=True)
class ComparedQuantity:
    """Quantity that is compared between model and rig, such as the level of a harmonic.

    `kind` groups quantities that share a bias. In `name`, ``{line}`` stands for the line of one of the `faults`, such
    as BPFO. The function `value_of` computes the value from the order of this line (frequency over shaft speed). A
    quantity without it is the level of the line's `harmonic`, or for 1 of its first sidebands, relative to the line.
    Errors of levels are in dB, all others in per cent of the rig's value. Model and rig agree if error plus uncertainty
    is below `margin`.
    """

    kind: str
    name: str
    harmonic: int = 1
    unit: str = "dB"
    faults: Collection[Fault] = DEFECTS
    value_of: ValueOfOrder | None = None
    margin: float = VERDICT.level_db

    def name_of(self, fault: Fault) -> str:
        """Name of the quantity for a fault, such as ``2xBPFO``, or ``2 x 2xBSF`` for the roller's line 2xBSF."""
        line = fault.line or ""
        return self.name.replace("x{line}", " x {line}" if line[:1].isdigit() else "x{line}").format(line=line)


def cage_ratio_of_order(fault: Fault, order: float, rolling_elements: int) -> float:
    """Cage ratio c from the order of a race line, with Z rollers: order / Z for BPFO, 1 - order / Z for BPFI.

    Slip lowers BPFO and raises BPFI, so errors may be averaged over both races for the cage ratio only.
    """
    return order / rolling_elements if fault is Fault.OUTER else 1 - order / rolling_elements


def _line_value(analysis: Analysis, fault: Fault, value_of: ValueOfOrder, order: float | None) -> QuantityValue | None:
    """Convert the order of a fault's line by `value_of`, with 95 % half widths; None if the line cannot be read.

    If `order` is given, it is converted instead of the order that is read from the signal.
    """
    line, shaft_hz, rollers = analysis.line_of(fault), analysis.speed.value_hz, analysis.bearing.rolling_elements
    if line.found_hz is None or not line.depth:
        return None
    kinematic = value_of(fault, line.kinematic_hz / shaft_hz, rollers)
    if order is not None:
        return QuantityValue(value=value_of(fault, order, rollers), kinematic=kinematic)
    read, slower = line.found_hz / shaft_hz, 1 - analysis.speed.ci95_hz / shaft_hz
    value = value_of(fault, read, rollers)
    return QuantityValue(
        value=value,
        ci95=abs(value_of(fault, read + (line.ci95_hz or 0.0) / shaft_hz, rollers) - value),
        speed_ci95=abs(value_of(fault, read * slower, rollers) - value),
        present=line.detected,
        kinematic=kinematic,
    )


def _level(analysis: Analysis, fault: Fault, harmonic: int) -> QuantityValue | None:
    """Level [dB] of harmonic number `harmonic` of a fault's line, or for 1 the mean level of its first sidebands.

    The reference is the first harmonic. None if the first harmonic, or the harmonic or all sidebands, cannot be read.
    """
    sidebands = [f"{fault.line}{sign}{fault.sidebands}" for sign in "-+" if fault.sidebands]
    names = [fault.line] if harmonic > 1 else sidebands
    first = analysis.line_of(fault)
    lines = [x for x in analysis.lines if x.name in names and x.harmonic == harmonic and x.depth]
    if first.found_hz is None or not first.depth or not lines:
        return None
    depth = sum(line.depth or 0.0 for line in lines) / len(lines)
    spread = math.hypot(*(_scatter_db(line) / len(lines) for line in lines), _scatter_db(first))
    return QuantityValue(
        value=_DB * math.log(depth / first.depth),
        ci95=NORMAL_95 * spread,
        present=first.detected and all(line.detected for line in lines),
    )


def _scatter_db(line: Line) -> float:
    """Standard error of a line's level [dB], from the line's signal-to-noise ratio."""
    return _DB / math.sqrt(2 * max(line.snr or 0.0, 0.5))


ROLLER_LINE = ComparedQuantity(
    kind="roller line",
    name="{line}",
    unit="order",
    value_of=lambda _, order, __: order,  # the cage does not determine the roller's own rotation
    faults=(Fault.ROLLER,),
    margin=TOLERANCE.limit_pct,
)
# Its information is that of the cage ratio, whose errors may be averaged over races.
RACE_LINE = replace(ROLLER_LINE, kind="race line", faults=RACE_DEFECTS)
CAGE_RATIO = replace(RACE_LINE, kind="cage ratio", name="cage ratio", unit="1", value_of=cage_ratio_of_order)
LINE_QUANTITIES = (RACE_LINE, ROLLER_LINE)
HARMONIC = {n: ComparedQuantity(kind=f"harmonic {n}", name=f"{n}x{{line}}", harmonic=n) for n in (2, 3, 4, 5)}
SIDEBAND_LEVEL = ComparedQuantity(kind="sideband level", name="{line} sidebands")
COMPARED: tuple[ComparedQuantity, ...] = (RACE_LINE, CAGE_RATIO, ROLLER_LINE, *HARMONIC.values(), SIDEBAND_LEVEL)


def effects_of(stored: Mapping[str, Any]) -> Effects:
    """Map (defect, quantity) to the effects of model inputs on this quantity, read from a study's result, `stored`."""
    return {(row["defect"], row["quantity"]): row for row in stored.get("effects", ())}


def read_quantities(analysis: Analysis, fault: Fault, order: float | None) -> dict[str, QuantityValue]:
    """Read the compared quantities of a fault's line from the analysis of a signal; returns the values by name.

    If `order` (line frequency over shaft speed) is given, it replaces the order that was read from the signal.
    """
    found = {}
    for row in (row for row in COMPARED if fault in row.faults):
        value_of = row.value_of
        value = _line_value(analysis, fault, value_of, order) if value_of else _level(analysis, fault, row.harmonic)
        if value is not None:
            found[row.name_of(fault)] = value
    return found


def biases(comparisons: pd.DataFrame) -> Iterator[Row]:
    """Compute the model's bias (mean error) for each kind of quantity, scene, and value of the column `used_for`.

    `comparisons` contains rows of `comparison_row` (which describes `used_for`). Only quantities that exceed the noise
    in both model and rig are used. `bias`, its half width `ci95` and the model's `scatter` are None with fewer than
    `MIN_RECORDS_FOR_BIAS` records.
    """
    both = comparisons["model_present"].astype(bool) & comparisons["rig_present"].astype(bool)
    names, places = ["kind", "scene", "used_for"], {row.kind: place for place, row in enumerate(COMPARED)}
    groups = comparisons[both].groupby(names, sort=False)
    for group, rows in sorted(groups, key=lambda group: places.get(group[0][0], len(places))):
        errors = rows.groupby("record", sort=False)["error"].mean()
        count, mean = len(errors), float(errors.mean())
        data = math.sqrt(float((rows["data_ci95"] ** 2).mean())) / NORMAL_95
        claimed = count >= MIN_RECORDS_FOR_BIAS
        variance = float(errors.var()) if claimed else 0.0
        yield dict(zip(names, group, strict=True)) | {
            "unit": rows["error_unit"].iloc[0],
            "records": count,
            "pairs": len(rows),
            "mean_error": mean,
            "bias": mean if claimed else None,
            "ci95": float(stdtrit(count - 1, 0.975)) * math.sqrt(variance / count) if claimed else None,
            "scatter": math.sqrt(max(variance - data**2, 0.0)) if claimed else None,
            "data_scatter": data,
        }
