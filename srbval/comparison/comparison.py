"""Comparison of one quantity between model and record: table row, error, uncertainty and verdict.

The uncertainty is the root of the sum of squares of its parts (ASME V&V 20, 2009). Theory: "Uncertainty of one
quantity". `budget.toml` contains the assumed ranges of inputs, margins and tolerances, with the reason of each number.
Verdicts on single quantities are exploratory; `srbval.comparison.verdicts` judges the cage ratio over all records.
"""

import enum
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd

from srbval.bearing import Fault
from srbval.scene import UncertainInput
from srbval.storage.tables import build, read_toml

BUDGET = Path(__file__).with_name("budget.toml")
PRIOR, TOLERANCE, VERDICT, STUDY = (
    SimpleNamespace(**read_toml(BUDGET)[name]) for name in ("prior", "tolerance", "verdict", "study")
)
INPUTS, GRID = "inputs: all together", "numerics: points and step"
RIG_READING, RIG_SPEED, MOUNTING = "rig reading", "rig speed", "rig mounting"
DATA_PARTS = (RIG_READING, RIG_SPEED, MOUNTING)
SIMULATION_READING = "simulation reading"  # no uncertainty of the simulation itself
TEXT_COLUMNS = ("record", "kind", "quantity", "unit", "error_unit", "scene", "used_for")
Row = dict[str, Any]  # one row of a table, by the names of its columns


def paper_inputs() -> tuple[UncertainInput, ...]:
    """Uncertain inputs of the paper's scene; the last ones are the ends of the envelope's band, ``band.low_hz``."""
    return tuple(build(UncertainInput, row, f"{BUDGET.name} {row['name']}") for row in read_toml(BUDGET)["input"])


class Verdict(enum.StrEnum):
    """Conclusion about an error, from its uncertainty and a margin, or from a stated tolerance."""

    AGREES = "agrees"
    DIFFERS = "differs"
    NOT_RESOLVED = "not resolved"
    INSUFFICIENT = "insufficient data"
    MET = "met"
    MISSED = "missed"


def verdict_on_error(error: float, uncertainty: float | None, margin: float | None = None) -> Verdict:
    """Verdict on an error from its `uncertainty` and the `margin` of agreement, all in the same unit."""
    if uncertainty is None:
        return Verdict.INSUFFICIENT
    if abs(error) > uncertainty:
        return Verdict.DIFFERS
    return Verdict.AGREES if margin is not None and abs(error) + uncertainty < margin else Verdict.NOT_RESOLVED


def verdict_on_tolerance(p_beyond: float, risk: float) -> Verdict:
    """Verdict on a tolerance exceeded with probability `p_beyond`: met if <= `risk`, missed if >= 1 - `risk`."""
    if risk < p_beyond < 1 - risk:
        return Verdict.NOT_RESOLVED
    return Verdict.MET if p_beyond <= risk else Verdict.MISSED


@dataclass(frozen=True, kw_only=True)
class QuantityValue:
    """Value of a compared quantity on one side, model or rig, with 95 % half widths.

    `ci95` is the half width due to reading, None if unknown, as for a printed value; `speed_ci95` is the half width due
    to the shaft speed. `present` is true if the value exceeds the noise. `kinematic` is the value in pure rolling.
    """

    value: float
    ci95: float | None = 0.0
    speed_ci95: float = 0.0
    present: bool = True
    kinematic: float | None = None


def comparison_row(
    *,
    model: QuantityValue,
    rig: QuantityValue,
    error: float,
    parts: Mapping[str, float],
    state: Fault = Fault.HEALTHY,
    margin: float | None = None,
    **names: str,
) -> Row:
    """Build the table row of one quantity compared between model and rig, as in `comparisons` of ``report.json``.

    `parts` are the parts of the error's uncertainty as 95 % half widths, in the unit of `error` and `margin`. Model and
    rig agree if error plus uncertainty is below `margin`. If all `parts` are due to the rig or to reading the simulated
    signal, the uncertainty is unknown (None). A value hidden in the noise of model or rig gets the verdict
    ``insufficient data``. In `names`, `kind` groups quantities that share a bias, `scene` is the simulation's input,
    `used_for` the record's use: ``fit`` (model fitted to it), ``withheld`` (known, but not fitted) or ``blind``
    (predicted before the record was known).
    """
    uncertainty = math.hypot(*parts.values()) if set(parts) - {*DATA_PARTS, SIMULATION_READING} else None
    known = model.present and rig.present and rig.ci95 is not None
    texts = dict.fromkeys(TEXT_COLUMNS, "") | {"scene": "paper", "used_for": "withheld"} | names
    return texts | {
        "state": state.value,
        "model": model.value,
        "model_ci95": model.ci95,
        "model_present": model.present,
        "rig": rig.value,
        "rig_ci95": rig.ci95,
        "rig_present": rig.present,
        "kinematic": rig.kinematic,
        "error": error,
        "uncertainty": uncertainty,
        "data_ci95": math.hypot(*(parts.get(part, 0.0) for part in DATA_PARTS)),
        "parts": dict(parts),
        "margin": margin,
        "verdict": verdict_on_error(error, uncertainty if known else None, margin).value,
    }


def comparison_frame(rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Table of rows from `comparison_row`; without rows, an empty table with the same columns."""
    nothing, found = QuantityValue(value=0.0), list(rows)
    return pd.DataFrame(found or [comparison_row(model=nothing, rig=nothing, error=0.0, parts={})]).iloc[: len(found)]


def plain_frame(rows: Iterable[Mapping[str, Any]], columns: Iterable[str] | None = None) -> pd.DataFrame:
    """Table of rows with plain Python values and None for missing values; `columns` selects and orders the columns."""
    frame = pd.DataFrame(list(rows), columns=None if columns is None else list(columns)).astype(object)
    return frame.where(frame.notna(), None)


def deviation_pct(value: float, reference: float) -> float:
    """Deviation of `value` from `reference` [%]."""
    return 100 * (value / reference - 1)
