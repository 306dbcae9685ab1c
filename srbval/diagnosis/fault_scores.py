"""What a record shows for each fault, on one scale: how far its family's comb stands above those of the record.

Each family is looked for after cepstrum prewhitening, which takes tones and gear meshes away, in the whole band: no
band is chosen, neither for a data set nor on the record.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from srbval.bearing import DEFECTS, Fault
from srbval.reading.analyse import Analysis
from srbval.reading.families import HARMONICS, Family, families_of, is_placebo_order
from srbval.reading.pipeline import whitened_periodogram
from srbval.recordings import ShaftSpeed
from srbval.signal import Periodogram
from srbval.signal.comb_spectrum import CombSpectrum, strongest_group
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
    out of the record's reach, `false_alarm` also where nothing is left to rank it among. Where a rolling element shows
    by a group of lines more clearly than by a comb (`strongest_group`), all this is the group's, `spacing_hz` apart.
    """

    fault: Fault
    found_hz: float | None
    excess: float | None
    false_alarm: float | None
    spacing_hz: float | None = None


@dataclass(frozen=True, kw_only=True)
class FaultScores:
    """Scores of all faults, and excess and order of the strongest comb that neither they nor the shaft explain.

    Where that comb is stronger than every fault's, it is that of the whole record; else that of what is left without
    the lines of the strongest fault.
    """

    parts: tuple[PartScore, ...]
    unexplained: float
    unexplained_order: float | None

    @property
    def features(self) -> tuple[float, ...]:
        """What classes are told by: of each fault its comb's excess over any other's, then that of the unexplained one.

        No value is below `SILENT`. Any other comb is another fault's, the unexplained one or a typical one. The last
        feature is the unexplained comb's excess, where a fault's is stronger the difference to it.
        """
        excess = [SILENT if part.excess is None else part.excess for part in self.parts]
        others = [max(0.0, self.unexplained, *excess[:n], *excess[n + 1 :]) for n in range(len(excess))]
        highest = max(0.0, *excess)
        last = self.unexplained if self.unexplained > highest else self.unexplained - highest
        own = (e - other for e, other in zip(excess, others, strict=True))
        return tuple(max(SILENT, value) for value in (*own, last))


def fault_scores(analysis: Analysis) -> FaultScores:
    """The scores of an analysed record, about the speed that its analysis found."""
    speed = analysis.speed
    families = families_of(analysis.bearing, speed.value_hz)
    relative = analysis.bearing.largest_slip + speed.ci95_hz / speed.value_hz
    record = whitened_periodogram(analysis.processed, analysis.bearing, speed)
    combs = _combs(record, speed)
    allowed = is_placebo_order(combs.frequency_hz, relative, families, speed)
    typical = combs.typical(relative)
    parts: list[PartScore] = []
    for fault, family in zip(DEFECTS, families, strict=False):
        score, found_hz = combs.highest(family.kinematic_hz, relative)
        placebos = combs.placebos(allowed, family.kinematic_hz, relative)
        part = _part(fault, score - typical, found_hz, neg_log_rank(score, placebos))
        if fault is Fault.ROLLER:  # the last: what is left without the lines of the clearer race
            race = _strongest(parts)
            rest = record if (race.excess or 0.0) <= 0 else _without(record, race, speed)
            part = _clearer(part, _as_group(rest, family, relative))
        parts.append(part)
    strongest = _strongest(parts)
    unexplained, order = _strongest_unexplained(combs, relative, analysis)
    if unexplained <= max(0.0, strongest.excess or 0.0):
        rest = _without(record, strongest, speed)
        unexplained, order = _strongest_unexplained(_combs(rest, speed), relative, analysis)
    return FaultScores(parts=tuple(parts), unexplained=unexplained, unexplained_order=order)


def _part(
    fault: Fault, excess: float, found_hz: float, neg_log_chance: float, spacing_hz: float | None = None
) -> PartScore:
    reached = not math.isnan(excess)
    return PartScore(
        fault=fault,
        found_hz=found_hz if reached else None,
        excess=excess if reached else None,
        false_alarm=None if math.isnan(neg_log_chance) else math.exp(-neg_log_chance),
        spacing_hz=spacing_hz,
    )


def _as_group(record: Periodogram, family: Family, relative: float) -> PartScore:
    """A rolling element's lines as a group: a cage's frequency apart, shifted against twice the element's spin."""
    group, others = strongest_group(record, family.kinematic_hz, family.sideband_hz, relative)
    if group is None or others.size == 0:
        return _part(Fault.ROLLER, math.nan, math.nan, math.nan)
    excess = group.score - float(np.median(others))
    return _part(Fault.ROLLER, excess, group.found_hz, neg_log_rank(group.score, others), group.spacing_hz)


def _clearer(comb: PartScore, group: PartScore) -> PartScore:
    """The one of greater excess, its chance that of the better of two."""
    best = _strongest((comb, group))
    chances = [part.false_alarm for part in (comb, group) if part.false_alarm is not None]
    return replace(best, false_alarm=1 - (1 - min(chances)) ** len(chances) if chances else None)


def _combs(record: Periodogram, speed: ShaftSpeed) -> CombSpectrum:
    return CombSpectrum.of(record, LEAST_ORDER * speed.value_hz, HARMONICS)


def _strongest(parts: Sequence[PartScore]) -> PartScore:
    return max(parts, key=lambda part: SILENT if part.excess is None else part.excess)


def _without(record: Periodogram, part: PartScore, speed: ShaftSpeed) -> Periodogram:
    """The record with the harmonics of a fault's line, if it was reached, and their sidebands masked."""
    if part.found_hz is None:
        return record
    number = np.arange(1, math.floor(record.limit_hz / part.found_hz) + 2, dtype=np.float64)[:, None]
    side_hz = np.arange(-SIDEBANDS, SIDEBANDS + 1)[None, :] * (part.spacing_hz or speed.value_hz)
    centre = number * part.found_hz + side_hz
    return record.masking(centre.ravel(), np.broadcast_to(number * part.found_hz * WANDER, centre.shape).ravel())


def _strongest_unexplained(combs: CombSpectrum, relative: float, analysis: Analysis) -> tuple[float, float | None]:
    """Excess over a typical comb and order of the strongest fundamental that means nothing in this bearing."""
    speed = analysis.speed
    families = families_of(analysis.bearing, speed.value_hz)
    allowed = is_placebo_order(combs.frequency_hz, relative / APART, families, speed)
    if not allowed.any():
        return 0.0, None
    best = int(np.argmax(np.where(allowed, combs.score, -np.inf)))
    return float(combs.score[best]) - combs.typical(relative), float(combs.frequency_hz[best]) / speed.value_hz
