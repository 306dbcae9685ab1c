"""One row of the table of comparisons: a quantity of a record of the rig that the model has too; words of verdicts.

A comparison has an error E, model minus rig, and its validation uncertainty U, the root of the squares of its parts by
numerics, inputs and data (ASME V&V 20, 2009). The model `differs` from the rig if |E| > U. It `agrees` only if |E| + U
is below a margin fixed beforehand: two one-sided tests (Schuirmann 1987), with U in place of 1.645 u so that they hold
whatever the distribution of the inputs. Everything between the two is `not resolved`. A stated tolerance is `met` or
`missed` by the chance that the error lies beyond it.

`budget.toml` states assumptions beside the model's inputs, with meaning and reason of each number. Verdicts on single
quantities are exploratory; `srbval.comparison.verdicts` judges the cage ratio over all records.
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
from srbval.storage.tables import read_toml

BUDGET = Path(__file__).with_name("budget.toml")
PRIOR, TOLERANCE, VERDICT, STUDY = (
    SimpleNamespace(**read_toml(BUDGET)[name]) for name in ("prior", "tolerance", "verdict", "study")
)
INPUTS, GRID = "inputs: all together", "numerics: points and step"
RIG_READING, RIG_SPEED, MOUNTING = "rig reading", "rig speed", "rig mounting"
DATA_PARTS = (RIG_READING, RIG_SPEED, MOUNTING)
SIMULATION_READING = "simulation reading"  # of a simulated signal; no uncertainty of the simulation itself
TEXT_COLUMNS = ("record", "kind", "quantity", "unit", "error_unit", "scene", "used_for")
Row = dict[str, Any]  # one row of a table, by the names of its columns


class Verdict(enum.StrEnum):
    """Conclusion that a comparison error and its uncertainty allow."""

    AGREES = "agrees"
    DIFFERS = "differs"
    NOT_RESOLVED = "not resolved"
    INSUFFICIENT = "insufficient data"
    MET = "met"
    MISSED = "missed"


def verdict_on_error(error: float, uncertainty: float | None, margin: float | None = None) -> Verdict:
    """Verdict by E and U, both in the same unit as the `margin`; without U the data are insufficient."""
    if uncertainty is None:
        return Verdict.INSUFFICIENT
    if abs(error) > uncertainty:
        return Verdict.DIFFERS
    return Verdict.AGREES if margin is not None and abs(error) + uncertainty < margin else Verdict.NOT_RESOLVED


def verdict_on_tolerance(p_beyond: float, risk: float) -> Verdict:
    """Verdict by the chance that the error lies beyond the tolerance: missed from 1 - `risk` on, met up to `risk`."""
    if risk < p_beyond < 1 - risk:
        return Verdict.NOT_RESOLVED
    return Verdict.MET if p_beyond <= risk else Verdict.MISSED


@dataclass(frozen=True, kw_only=True)
class QuantityValue:
    """A quantity as read from one side, model or rig, with 95 % half widths.

    `ci95` is that of the reading, None if the source states none; `speed_ci95` is the effect of the shaft speed's. The
    value is `present` if it stands out of the noise. `kinematic`: value in pure rolling.
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
    """Row of the table of comparisons, with the keys of `comparisons` in ``report.json``.

    `error`, `margin` and `parts` of the uncertainty (95 % half widths) are in `error_unit`. The uncertainty is None
    if nothing but readings is known. No verdict is given on a level that one side does not show, since that level
    is the noise's. Of the `names`, `kind` groups quantities that share a bias, `unit` is that of model and rig,
    `scene` the bundled scene of the model, and `used_for` is ``fit`` (fitted to the record), ``withheld`` (not
    fitted, but seen) or ``blind`` (predicted before).
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
        "dominant": max(parts, key=lambda name: parts[name], default=""),
        "margin": margin,
        "verdict": verdict_on_error(error, uncertainty if known else None, margin).value,
    }


def comparison_frame(rows: Iterable[Mapping[str, Any]]) -> pd.DataFrame:
    """Frame of rows as `comparison_row` makes them; an empty frame has the same columns."""
    nothing, found = QuantityValue(value=0.0), list(rows)
    return pd.DataFrame(found or [comparison_row(model=nothing, rig=nothing, error=0.0, parts={})]).iloc[: len(found)]


def plain_frame(rows: Iterable[Mapping[str, Any]], columns: Iterable[str] | None = None) -> pd.DataFrame:
    """Frame of rows with plain values, None for missing ones; `columns` (by default all keys) in their order."""
    frame = pd.DataFrame(list(rows), columns=None if columns is None else list(columns)).astype(object)
    return frame.where(frame.notna(), None)


def deviation_pct(value: float, reference: float) -> float:
    """Deviation of `value` from `reference` [%]."""
    return 100 * (value / reference - 1)
