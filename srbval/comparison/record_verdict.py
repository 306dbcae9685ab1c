"""The verdict on the model by record: all primary quantities of one record at once, and all records together.

The errors E of a record's cage ratio, levels and sidebands have one covariance V: inputs and starts move them together,
all levels share the record's first harmonic, the sensor's mounting adds to each level. D^2 = E' V^-1 E is compared with
its own distribution by `TRIALS` draws: of the inputs' own runs, which are not normal, of normal errors of reading, and
of a mounting of unknown size (half-normal prior). It is chi-squared where only the normal errors count. Holm's
procedure (1979, Scand. J. Stat. 6, 65) keeps the chance of any false "resolved" among all records at 5 %. "Agrees"
needs every quantity surely within its margin (intersection-union: Berger 1982, Technometrics 24, 295); between the two
it is undecided. A level below one side's detection is censored: its error counts as the least that this allows, and it
cannot agree.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from srbval.arrays import FloatArray
from srbval.comparison.budget import PRIOR, VERDICT
from srbval.comparison.compared_quantities import COMPARED, FREQUENCIES
from srbval.comparison.comparison import MODEL_STARTS, MOUNTING, RIG_READING, RIG_SPEED, Comparison, ComparisonVerdict
from srbval.comparison.effects import GRID, DefectEffects
from srbval.signal import NORMAL_95

PRIMARY = tuple(row.kind for row in COMPARED if row.primary)
TRIALS, SEED = 20_000, 3


@dataclass(frozen=True, kw_only=True)
class RecordVerdict:
    """Of one record: errors of its primary `quantities`, their standard deviations `u`, those `censored`, the verdict.

    `p` is the chance of so large a `d2` if the model were right, `p_discrepancy` if it had no more than the error that
    the prior allows any such model; `p_holm` is `p` after Holm over all records.
    """

    JSON_PROPERTIES: ClassVar = ("verdict",)

    record: str
    quantities: tuple[str, ...]
    units: tuple[str, ...]
    errors: tuple[float, ...]
    u: tuple[float, ...]
    censored: tuple[str, ...]
    d2: float
    p: float
    p_discrepancy: float
    p_holm: float
    agrees: bool

    @property
    def verdict(self) -> ComparisonVerdict:
        """What may be said."""
        if self.p_holm < VERDICT.false_resolved:
            return ComparisonVerdict.RESOLVED
        return ComparisonVerdict.AGREES if self.agrees else ComparisonVerdict.UNDECIDED


def record_verdict(rows: Iterable[Comparison], effects: DefectEffects | None) -> RecordVerdict | None:
    """The verdict on one record by its comparisons, before Holm; None where inputs or frequency are not known."""
    if effects is None:
        return None
    primary = [(row, _error(row)) for row in rows if row.kind in PRIMARY and effects.of(row.quantity)]
    used = [row for row, error in primary if error is not None]
    error = np.array([error for _, error in primary if error is not None])
    levels = np.array([float(row.kind not in FREQUENCIES) for row in used])
    if levels.all():
        return None
    scales = np.array([100 / row.rig.value if row.kind in FREQUENCIES else 1.0 for row in used])
    own, inputs = covariance(used), effects.deviations([row.quantity for row in used]) * scales
    mounting = max(row.parts.get(MOUNTING, 0.0) for row in used) / NORMAL_95
    d2, p = tail(error, own, levels, mounting=mounting, inputs=inputs)
    wider = own + np.diag((1 - levels) * PRIOR.discrepancy_pct**2)
    _, p_discrepancy = tail(error, wider, levels, mounting=mounting, discrepancy=PRIOR.discrepancy_db, inputs=inputs)
    return RecordVerdict(
        record=used[0].record,
        quantities=tuple(row.quantity for row in used),
        units=tuple(row.error_unit for row in used),
        errors=tuple(error.tolist()),
        u=tuple(np.sqrt(np.diag(own + _spread(inputs)) + levels * mounting**2).tolist()),
        censored=tuple(row.quantity for row in used if not row.both_present),
        d2=d2, p=p, p_discrepancy=p_discrepancy, p_holm=p,
        agrees=all(row.within_margin for row in used),
    )  # fmt: skip


def holm(found: Sequence[RecordVerdict]) -> tuple[RecordVerdict, ...]:
    """The same with `p_holm` over all of them, in their order."""
    adjusted = holm_adjusted([one.p for one in found])
    return tuple(replace(one, p_holm=p) for one, p in zip(found, adjusted.tolist(), strict=True))


def holm_adjusted(chances: ArrayLike) -> FloatArray:
    """Chances [n] after Holm's procedure, in their order."""
    p = np.asarray(chances, dtype=float)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty_like(p)
    adjusted[order] = np.maximum.accumulate(np.minimum(1.0, np.arange(p.size, 0, -1) * p[order]))
    return adjusted


def covariance(rows: Sequence[Comparison]) -> FloatArray:
    """Of the normal errors of one record's quantities, in the units of the errors: all but inputs and mounting."""
    parts = (MODEL_STARTS, RIG_READING, RIG_SPEED, GRID)
    first = np.array([0.0 if row.kind in FREQUENCIES else row.rig.first_ci95 / NORMAL_95 for row in rows])
    own = np.outer(first, first)
    np.fill_diagonal(own, [sum((row.parts.get(part, 0.0) / NORMAL_95) ** 2 for part in parts) for row in rows])
    return np.asarray(own)


def tail(
    error: FloatArray, own: FloatArray, levels: FloatArray, *, inputs: FloatArray,
    mounting: float = 0.0, discrepancy: float = 0.0,
) -> tuple[float, float]:  # fmt: skip
    """D^2 of an error and its chance.

    Errors are normal with covariance `own`; of the inputs, one row of `inputs`, [draws, quantities]; and of the
    `levels` (1, else 0) of unknown sizes: `mounting` and `discrepancy` are the scales [dB] of their half-normal priors,
    whose mean square is the scale's own.
    """
    whole = own + _spread(inputs) + np.diag(levels) * (mounting**2 + discrepancy**2)
    inverse = np.linalg.inv(whole)
    d2 = float(error @ inverse @ error)
    normal = _normal(error.size + 2)
    drawn = normal[:, : error.size] @ np.linalg.cholesky(own).T + inputs[np.arange(TRIALS) % len(inputs)]
    sizes = np.hypot(mounting * normal[:, -2], discrepancy * normal[:, -1])
    drawn += levels * sizes[:, None] * _normal(error.size, SEED + 1)
    as_large = int(np.count_nonzero(((drawn @ inverse) * drawn).sum(axis=1) >= d2))
    return d2, (1 + as_large) / (TRIALS + 1)


def _spread(inputs: FloatArray) -> FloatArray:
    """Covariance of draws about zero, [quantities, quantities]."""
    return np.asarray(inputs.T @ inputs / len(inputs))


@cache
def _normal(columns: int, seed: int = SEED) -> FloatArray:
    return np.random.default_rng(seed).standard_normal((TRIALS, columns))


def _error(row: Comparison) -> float | None:
    """The error; the least that detection allows where one side is below it; None where both are."""
    if row.both_present:
        return row.error
    if not row.model.present and not row.rig.present:
        return None
    if row.rig.present:
        return min(row.model.least - row.rig.value, 0.0)
    return max(row.model.value - row.rig.least, 0.0)
