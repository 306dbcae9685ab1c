"""Comparison of a simulated with a measured side: for each quantity error, uncertainty and verdict.

An external model has an uncertainty only if repeated files are given (Student's t of their mean) or the case states it;
otherwise the verdict is ``insufficient data``. The reading error of a simulated line alone is not enough. Lines and
cage ratio are compared in orders of the shaft, each side by its own speed.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from srbval.bearing import Fault
from srbval.comparison import comparison
from srbval.comparison.compared_quantities import CAGE_RATIO, COMPARED, LINE_QUANTITIES, ComparedQuantity, Effects
from srbval.comparison.comparison import QuantityValue, Row, Verdict
from srbval.signal import NORMAL_95
from srbval.validation.case import Tolerance, ValidationCase
from srbval.validation.sides import SideReading

STATED_PART, REPEATS_PART = "simulation: stated", "simulation: repeats"
MAX_SPEED_DIFFERENCE = 1e-3  # relative difference of shaft speeds up to which lines are compared in Hz
MISSING_VALUE = QuantityValue(value=math.nan, ci95=None, present=False)  # of a quantity not found on a side
PAIR_KEYS = ("pair", "simulated_hz", "measured_hz", "speeds_hz")  # keys of a row beyond those of `comparison_row`
VALIDATION_COLUMNS = ["pair", "state", "quantity", "unit", "kinematic", "simulated", "simulated_ci95"]
VALIDATION_COLUMNS += ["measured", "measured_ci95", "error", "error_unit", "uncertainty", "parts", "verdict"]
VALIDATION_COLUMNS += ["used_for", "simulated_hz", "measured_hz", "simulated_deviation_pct", "measured_deviation_pct"]


def compare_pair(
    number: int, state: Fault, sides: Mapping[str, SideReading], case: ValidationCase, effects: Effects, used_for: str
) -> Iterator[Row]:
    """Compare simulated with measured signals (two sides): a `comparison_row` for each quantity found on either side.

    In a row, `model` is the simulated and `rig` the measured side. `effects` of uncertain inputs, time step and
    contact points apply to the scene `paper` alone. `simulated_hz` and `measured_hz` are a line's frequency at the
    speed of each side, `speeds_hz` the shaft speeds of both sides.
    """
    simulated, measured = sides.get("simulated"), sides.get("measured")
    base = simulated.scene if simulated is not None else None
    speeds: list[Any] = [None if side is None else side.shaft_hz for side in (simulated, measured)]
    for quantity in (one for one in COMPARED if state in one.faults):
        name = quantity.name_of(state)
        own, theirs = (ensemble(side, name) for side in (simulated, measured))
        known = [own is not MISSING_VALUE, theirs is not MISSING_VALUE]
        if not any(known):
            continue
        scale = 100 / theirs.value if quantity.value_of else 1.0
        # U of a frequency includes the rig's shaft speed. U of a level includes the sensor's mounting, whose effect
        # cannot be separated from the model's error with a single mounting.
        mounting = {comparison.MOUNTING: NORMAL_95 * comparison.PRIOR.mounting_db}
        parts = {comparison.RIG_READING: scale * (theirs.ci95 or 0.0)}
        parts |= {comparison.RIG_SPEED: scale * theirs.speed_ci95} if quantity.value_of else mounting
        studied = effects.get((state.value, name)) if base == "paper" else None
        if studied is not None:
            own = replace(own, value=own.value + studied["shift"])
            parts |= {comparison.INPUTS: scale * studied["inputs_ci95"], comparison.GRID: scale * studied["grid_ci95"]}
        if all(known) and base != "paper":
            repeated = simulated is not None and len(simulated.values) > 1
            reading = REPEATS_PART if repeated else comparison.SIMULATION_READING
            parts |= {reading: abs(scale * (own.ci95 or 0.0))} | stated_part(quantity, state, own.value, case)
        row = comparison.comparison_row(
            model=own,
            rig=replace(theirs, kinematic=own.kinematic if theirs.kinematic is None else theirs.kinematic),
            error=scale * (own.value - theirs.value),
            error_unit="%" if quantity.value_of else "dB",
            parts=parts,
            state=state,
            margin=tolerance_of(quantity, case.tolerance) or quantity.margin,
            scene=base or "",
            record=sides["measured" if measured is not None else "simulated"].files[0],
            kind=quantity.kind,
            quantity=name,
            unit=quantity.unit,
            used_for=used_for,
        )
        hz = [
            one.value * shaft_hz if shown and quantity in LINE_QUANTITIES else None
            for one, shaft_hz, shown in zip((own, theirs), speeds, known, strict=True)
        ]
        yield row | {"pair": number, "simulated_hz": hz[0], "measured_hz": hz[1], "speeds_hz": speeds}


def ensemble(side: SideReading | None, name: str) -> QuantityValue:
    """Mean of a quantity over the simulated or the measured signals, `MISSING_VALUE` if a signal lacks the quantity.

    The half width of several signals comes from the scatter between them, which includes reading errors but not the
    error of the shaft speed, common to all.
    """
    values = [] if side is None else [one[name] for one in side.values if name in one]
    if side is None or len(values) < len(side.values):
        return MISSING_VALUE
    if len(values) == 1:
        return values[0]
    found = np.array([one.value for one in values])
    return QuantityValue(
        value=float(found.mean()),
        ci95=float(stdtrit(found.size - 1, 0.975) * found.std(ddof=1) / math.sqrt(found.size)),
        speed_ci95=max(one.speed_ci95 for one in values),
        present=all(one.present for one in values),
        kinematic=values[0].kinematic,
    )


def stated_part(quantity: ComparedQuantity, state: Fault, value: float, case: ValidationCase) -> dict[str, float]:
    """Part of the uncertainty [% or dB] of an external simulation's `value` that the case states; empty if none.

    A stated 1 % of the cage ratio c is 1 % of BPFO and c / (1 - c) % of BPFI; it does not apply to the line of a
    rolling element, which depends on its spin.
    """
    stated = case.uncertainty.cage_pct if quantity.value_of else case.uncertainty.level_db
    if stated is None or (quantity.value_of and state is Fault.ROLLER):
        return {}
    of_line = quantity in LINE_QUANTITIES and state is Fault.INNER
    return {STATED_PART: stated * (case.known_bearing.rolling_elements / value - 1) if of_line else stated}


def tolerance_of(quantity: ComparedQuantity, tolerance: Tolerance) -> float | None:
    """Tolerance of a quantity [% or dB]; None for the frequency of a fault line, or if the case states none."""
    if quantity.value_of:
        return tolerance.cage_pct if quantity is CAGE_RATIO else None
    return tolerance.level_db


def table_of(rows: Sequence[Row], tolerance: Tolerance) -> pd.DataFrame:
    """Table with a row for each comparison in `rows`; if a tolerance is stated, the verdict refers to it."""
    return comparison.plain_frame([_table_row(row, tolerance) for row in rows], VALIDATION_COLUMNS)


def _table_row(row: Row, tolerance: Tolerance) -> Row:
    quantity = next(one for one in COMPARED if one.kind == row["kind"])
    values = {"simulated": row["model"], "measured": row["rig"], "kinematic": row["kinematic"]}
    values |= {"simulated_ci95": row["model_ci95"] or None, "measured_ci95": row["rig_ci95"]}
    for side in ("simulated", "measured"):
        known = values["kinematic"] is not None and not math.isnan(values[side])
        values[f"{side}_deviation_pct"] = comparison.deviation_pct(values[side], values["kinematic"]) if known else None
    found, limit = row | values, tolerance_of(quantity, tolerance)
    if limit is not None and row["verdict"] != Verdict.INSUFFICIENT:
        chance = chance_beyond_limit(row["error"], row["uncertainty"], limit)
        found["verdict"] = comparison.verdict_on_tolerance(chance, comparison.TOLERANCE.risk).value
    if quantity not in LINE_QUANTITIES:
        return found | {"quantity": row["kind"]}
    simulated_hz, measured_hz = row["speeds_hz"]
    if same_speed(simulated_hz, measured_hz):
        hz = measured_hz or simulated_hz
        found |= {key: v and v * hz for key, v in values.items() if not key.endswith("_pct")} | {"unit": "Hz"}
    return found | {"quantity": Fault(row["state"]).line}


def same_speed(one_hz: float | None, other_hz: float | None) -> bool:
    """True if both shaft speeds differ by at most `MAX_SPEED_DIFFERENCE`, or if one is unknown."""
    return one_hz is None or other_hz is None or abs(one_hz / other_hz - 1) <= MAX_SPEED_DIFFERENCE


def chance_beyond_limit(error: float, uncertainty: float, limit: float) -> float:
    """Probability that a normal error with mean `error` and 95 % half width `uncertainty` exceeds +-`limit`."""
    if uncertainty == 0:
        return float(abs(error) > limit)
    spread = uncertainty / NORMAL_95 * math.sqrt(2)
    return 1 - (math.erf((limit - error) / spread) + math.erf((limit + error) / spread)) / 2
