"""How many withheld quantities are within the limit, by the healthy record alone too, and how many could be at most."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.comparison.budget import VERDICT
from srbval.comparison.comparison import Comparison

LOCKED, HARMONICS, TOTAL = "locked level", "harmonic pattern", "total level"
SHIFTS_DB = np.arange(-400, 401) / 10  # of a third octave's gain, among which the best is looked for
Row = dict[str, Any]
Levels = Mapping[str, Mapping[str, float]]  # [dB re 1 m/s2], by record and quantity


def counts(found: Sequence[Comparison], healthy: Levels) -> Row:
    """How many withheld bands, harmonics and totals are within the limit; `shown`: of those alone that the rig shows.

    A locked band that the record does not show is within it where the model is no farther above what would be shown.
    `healthy`: totals of the healthy record of each record's speed. `ceiling`: see there; `halves`: of the bands shown,
    how many one half of the record predicts from the other.
    """
    of = {kind: [row for row in found if row.kind == kind and row.used_for == "withheld"]
          for kind in (LOCKED, HARMONICS, TOTAL)}  # fmt: skip
    shown = [row for row in of[LOCKED] if row.rig.present]
    halves = [float(np.diff(row.rig.halves)[0]) for row in shown if row.rig.halves is not None]
    return {
        "locked": _count([row.error for row in of[LOCKED]])
        | {"shown": _count([row.error for row in shown]), "halves": _count(halves), "ceiling": ceiling(of[LOCKED], {})},
        "harmonics": _count([row.error for row in of[HARMONICS] if row.rig.present]),
        "totals": _count([row.error for row in of[TOTAL]])
        | {"healthy_alone": _count(healthy_errors(found, healthy))["within"], "ceiling": ceiling(of[TOTAL], healthy)},
    }  # fmt: skip


def _count(errors_db: Sequence[float]) -> Row:
    return {"within": sum(abs(error) <= VERDICT.near_db for error in errors_db), "of": len(errors_db)}


def healthy_errors(found: Sequence[Comparison], healthy: Levels) -> list[float]:
    """Errors of the healthy record's level as the prediction of each withheld total [dB]."""
    return [
        healthy[row.record][row.quantity] - row.rig.value
        for row in found if row.kind == TOTAL and row.used_for == "withheld"
    ]  # fmt: skip


def ceiling(found: Sequence[Comparison], healthy: Levels) -> int:
    """How many of these rows are within the limit where each third octave's gain is the best for all of them at once.

    No path that all records share can count more with these runs and this ratio of its directions: it is fitted to what
    it is counted on. To a total the `healthy` record's power is added, which the gain does not move.
    """
    near = defaultdict[str, FloatArray](lambda: np.zeros(SHIFTS_DB.size))
    for row in found:
        quiet = 10 ** (healthy[row.record][row.quantity] / 10) if healthy else 0.0
        model = max(10 ** (row.model.value / 10) - quiet, 1e-30)
        off = 10 * np.log10(quiet + model * 10 ** (SHIFTS_DB / 10))
        off -= row.rig.value if row.rig.present else row.rig.least
        near[row.quantity] += (off <= VERDICT.near_db) & ((off >= -VERDICT.near_db) | (not row.rig.present))
    return int(sum(best.max() for best in near.values()))
