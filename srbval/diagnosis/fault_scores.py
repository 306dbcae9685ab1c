"""What a record shows for each fault, on one scale: how far its family's comb stands above those of the record.

Each family is looked for after cepstrum prewhitening, which takes tones and gear meshes away, in all parts of the whole
band together: no band is chosen, neither for a data set nor on the record.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from srbval.bearing import DEFECTS, Fault
from srbval.reading.analyse import Analysis
from srbval.reading.families import HARMONICS, families_of, is_placebo_order
from srbval.reading.pipeline import whitened_bands
from srbval.signal import Periodogram
from srbval.signal.comb_spectrum import CombSpectrum
from srbval.signal.false_alarm import APART, neg_log_rank

# Combs are looked for from this order of the shaft up.
LEAST_ORDER = 1.1
# Sidebands of the strongest family that are taken as its own, and how far slip spreads a line, as a share of it.
SIDEBANDS, WANDER = 4, 1e-3
# A comb that stands this far below a typical one, or below another fault's, is as silent as any.
SILENT = -1.0


@dataclass(frozen=True, kw_only=True)
class PartScore:
    """`excess`: by how much the score of a fault's comb exceeds that of a typical comb of the record.

    `found_hz` is its fundamental, `false_alarm` the chance that a placebo is as strong. None where the comb is
    out of the record's reach, `false_alarm` also where nothing is left to rank it among.
    """

    fault: Fault
    found_hz: float | None
    excess: float | None
    false_alarm: float | None


@dataclass(frozen=True, kw_only=True)
class FaultScores:
    """Scores of all faults, and excess and order of the strongest comb that neither they nor the shaft explain.

    Where that comb is stronger than every fault's, the faults' scores are those of what is left without its lines, for
    lines that two combs share make no fault; else the comb is that of what is left without the strongest fault's.
    """

    parts: tuple[PartScore, ...]
    unexplained: float
    unexplained_order: float | None

    @property
    def strongest(self) -> PartScore:
        """That of the greatest excess."""
        return max(self.parts, key=lambda part: SILENT if part.excess is None else part.excess)

    @property
    def features(self) -> tuple[float, ...]:
        """What classes are told by: each fault's excess over any other fault's, and the unexplained one's over theirs.

        No value is below `SILENT`. A comb of another machine part beside a fault's is no evidence against the fault.
        """
        excess = [SILENT if part.excess is None else part.excess for part in self.parts]
        others = [max(0.0, *excess[:n], *excess[n + 1 :]) for n in range(len(excess))]
        own = (e - other for e, other in zip(excess, others, strict=True))
        return tuple(max(SILENT, value) for value in (*own, self.unexplained - max(0.0, *excess)))


def fault_scores(analysis: Analysis) -> FaultScores:
    """The scores of an analysed record, about the speed that its analysis found."""
    shaft_hz = analysis.speed.value_hz
    bands = whitened_bands(analysis.processed, analysis.bearing, analysis.speed)
    found = _scores(bands, analysis)
    order, strongest = found.unexplained_order, found.strongest
    if order is not None and found.unexplained > max(0.0, strongest.excess or 0.0):
        return replace(found, parts=_scores(_without(bands, order * shaft_hz, shaft_hz), analysis).parts)
    if strongest.found_hz is None:
        return found
    return replace(_scores(_without(bands, strongest.found_hz, shaft_hz), analysis), parts=found.parts)


def _scores(bands: Sequence[Periodogram], analysis: Analysis) -> FaultScores:
    """All of one set of spectra."""
    speed, bearing = analysis.speed, analysis.bearing
    families = families_of(bearing, speed.value_hz)
    relative = bearing.largest_slip + speed.ci95_hz / speed.value_hz
    combs = CombSpectrum.of(bands, LEAST_ORDER * speed.value_hz, HARMONICS)
    allowed = is_placebo_order(combs.frequency_hz, relative, families, speed)
    typical = combs.typical(relative)
    parts = []
    for fault, family in zip(DEFECTS, families, strict=False):
        score, found_hz = combs.highest(family.kinematic_hz, relative)
        chance = neg_log_rank(score, combs.placebos(allowed, family.kinematic_hz, relative))
        excess, found = (None, None) if math.isnan(score) else (score - typical, found_hz)
        false_alarm = None if math.isnan(chance) else math.exp(-chance)
        parts.append(PartScore(fault=fault, found_hz=found, excess=excess, false_alarm=false_alarm))
    means_nothing = is_placebo_order(combs.frequency_hz, relative / APART, families, speed)
    if not means_nothing.any():
        return FaultScores(parts=tuple(parts), unexplained=0.0, unexplained_order=None)
    best = int(np.argmax(np.where(means_nothing, combs.score, -np.inf)))
    return FaultScores(
        parts=tuple(parts), unexplained=float(combs.score[best]) - typical,
        unexplained_order=float(combs.frequency_hz[best]) / speed.value_hz,
    )  # fmt: skip


def _without(bands: Sequence[Periodogram], found_hz: float, spacing_hz: float) -> list[Periodogram]:
    """The spectra with the harmonics of a comb and their sidebands, `spacing_hz` apart, masked."""
    number = np.arange(1, math.floor(bands[0].limit_hz / found_hz) + 2, dtype=np.float64)[:, None]
    centre = (number * found_hz + np.arange(-SIDEBANDS, SIDEBANDS + 1)[None, :] * spacing_hz).ravel()
    half_hz = np.repeat(number.ravel() * found_hz * WANDER, 2 * SIDEBANDS + 1)
    return [band.masking(centre, half_hz) for band in bands]
