"""Scores of all faults in a record on one scale: the excess of a fault's comb over a typical comb of the record.

Combs are searched after cepstrum prewhitening in all parts of the whole band together: no band is chosen.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from srbval.bearing import DEFECTS
from srbval.reading.analyse import Analysis
from srbval.reading.families import HARMONICS, families_of, is_placebo_order
from srbval.reading.pipeline import whitened_bands
from srbval.recordings import SpeedSource
from srbval.signal import Periodogram
from srbval.signal.comb_spectrum import CombSpectrum
from srbval.signal.false_alarm import APART, neg_log_rank

LEAST_ORDER = 1.1  # of the shaft, from which combs are searched
SIDEBANDS, WANDER = 4, 1e-3  # of the strongest family, and the spread of a line by slip, as a share of its frequency
# So many placebos count as one: windows overlap by half, and mixed combs repeat the record's lines. With it 0.6 to
# 1.4 % of the chances are below 1 % on seven kinds of background without a fault, 2.8 % on another bearing's impacts.
REPEATED = 6.5
# The cage's comb stands out from this excess. Of 30 records of healthy bearings 6 reach it, those of the IMS bearing
# whose roller failed a month later (6.4 to 7.2); the others stay below 3.
CAGE_SHOWN = 5.0
SILENT = -1.0  # least value of a feature: a comb this far below a typical one, or another fault's, is silent


@dataclass(frozen=True, kw_only=True)
class FaultScores:
    """Scores of all faults, and excess and order of the strongest comb that neither they nor the shaft explain.

    `parts` are rows: a fault, the excess of its comb over a typical comb of the record, its fundamental `found_hz`, and
    `false_alarm`, the chance that a placebo is as strong; None out of the record's reach, or without placebos. If the
    unexplained comb is stronger than every fault's, the faults are scored without its lines; otherwise it is searched
    without the lines of the strongest fault. `cage` is the excess of the cage's comb, which names no fault; None if out
    of reach. `unmasked` are the excesses of the faults with no lines masked.
    """

    parts: tuple[dict[str, Any], ...]
    unexplained: float
    unexplained_order: float | None
    cage: float | None
    unmasked: tuple[float, ...]

    @property
    def cage_shows(self) -> bool:
        """True if the cage's comb stands out."""
        return self.cage is not None and self.cage >= CAGE_SHOWN

    @property
    def features(self) -> tuple[float, ...]:
        """Excess of each fault over the other faults, and of the unexplained comb over all faults; at least `SILENT`.

        A comb of another machine part is no evidence against a fault.
        """
        excess = excesses_of(self.parts)
        others = [max(0.0, *excess[:n], *excess[n + 1 :]) for n in range(len(excess))]
        own = (e - other for e, other in zip(excess, others, strict=True))
        return tuple(max(SILENT, value) for value in (*own, self.unexplained - max(0.0, *excess)))


def fault_scores(analysis: Analysis) -> FaultScores:
    """Score an analysed record about the speed that its analysis found.

    At a set point no harmonics of the shaft are masked: they may be anywhere within its tolerance.
    """
    speed, bearing = analysis.speed, analysis.bearing
    shaft_hz, relative = speed.value_hz, bearing.largest_slip + speed.ci95_hz / speed.value_hz
    bands: Sequence[Periodogram] = whitened_bands(analysis.processed, bearing, speed)
    if speed.source is SpeedSource.NOMINAL:
        bands = [replace(band, masks_hz=np.empty((0, 2))) for band in bands]
    whole = CombSpectrum.of(bands, LEAST_ORDER * shaft_hz, HARMONICS)
    parts, (unexplained, order) = _parts(whole, analysis, relative), _unexplained(whole, analysis, relative)
    excesses = excesses_of(parts)
    lines_hz = parts[int(np.argmax(excesses))]["found_hz"]
    if is_foreign := order is not None and unexplained > max(0.0, *excesses):
        lines_hz = order * shaft_hz
    if lines_hz is not None:
        rest = CombSpectrum.of(_without(bands, lines_hz, shaft_hz), LEAST_ORDER * shaft_hz, HARMONICS)
        if is_foreign:
            parts = _parts(rest, analysis, relative)
        else:
            unexplained, order = _unexplained(rest, analysis, relative)
    cage_hz = families_of(bearing, shaft_hz)[-1].kinematic_hz
    low_hz, high_hz = cage_hz * (1 - APART * relative), cage_hz * (1 + APART * relative)
    cage, _ = CombSpectrum.of(bands, low_hz, HARMONICS, high_hz).highest(cage_hz, relative)
    return FaultScores(
        parts=parts,
        unexplained=unexplained,
        unexplained_order=order,
        unmasked=tuple(excesses),
        cage=None if math.isnan(cage) else cage - whole.typical(relative),
    )


def _parts(combs: CombSpectrum, analysis: Analysis, relative: float) -> tuple[dict[str, Any], ...]:
    """Scores of all faults, searched within the share `relative` about their kinematic frequencies."""
    families, parts = families_of(analysis.bearing, analysis.speed.value_hz), []
    typical = combs.typical(relative)
    allowed = is_placebo_order(combs.frequency_hz, relative, families, analysis.speed)
    for fault, family in zip(DEFECTS, families, strict=False):
        score, found_hz = combs.highest(family.kinematic_hz, relative)
        placebos = combs.placebos(allowed, family.kinematic_hz, relative)
        chance = neg_log_rank(score, placebos, independent=placebos.size / REPEATED)
        excess, found = (None, None) if math.isnan(score) else (score - typical, found_hz)
        false_alarm = None if math.isnan(chance) else math.exp(-chance)
        parts.append({"fault": fault, "found_hz": found, "excess": excess, "false_alarm": false_alarm})
    return tuple(parts)


def excesses_of(parts: Iterable[Mapping[str, Any]]) -> list[float]:
    """Excess of the comb of each fault, `SILENT` if it is out of the record's reach."""
    return [SILENT if part["excess"] is None else part["excess"] for part in parts]


def _unexplained(combs: CombSpectrum, analysis: Analysis, relative: float) -> tuple[float, float | None]:
    """Excess and order of the strongest comb at a meaningless order of the bearing; None without such orders."""
    shaft_hz = analysis.speed.value_hz
    families = families_of(analysis.bearing, shaft_hz)
    means_nothing = is_placebo_order(combs.frequency_hz, relative / APART, families, analysis.speed)
    if not means_nothing.any():
        return 0.0, None
    best = int(np.argmax(np.where(means_nothing, combs.score, -np.inf)))
    return float(combs.score[best]) - combs.typical(relative), float(combs.frequency_hz[best]) / shaft_hz


def _without(bands: Sequence[Periodogram], found_hz: float, spacing_hz: float) -> list[Periodogram]:
    number = np.arange(1, math.floor(bands[0].limit_hz / found_hz) + 2, dtype=np.float64)[:, None]
    centre = (number * found_hz + np.arange(-SIDEBANDS, SIDEBANDS + 1)[None, :] * spacing_hz).ravel()
    half_hz = np.repeat(number.ravel() * found_hz * WANDER, 2 * SIDEBANDS + 1)
    return [band.masking(centre, half_hz) for band in bands]
