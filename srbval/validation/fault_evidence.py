"""What a record shows for each fault, on one scale: how far its family's comb stands above those of the record.

Each family is looked for after cepstrum prewhitening, which takes tones and gear meshes away, in the whole band: no
band is chosen, neither for a data set nor on the record.
"""

import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import DEFECTS, Fault
from srbval.recordings import ShaftSpeed
from srbval.signal import Periodogram
from srbval.signal.comb_spectrum import CombSpectrum, neg_log_rank
from srbval.signal.placebo import APART
from srbval.validation.analyse import Analysis
from srbval.validation.families import HARMONICS, families_of, means_nothing
from srbval.validation.speed_search import whitened_periodogram

# Combs are looked for from this order of the shaft up.
LEAST_ORDER = 1.1
# Sidebands of the strongest family that are taken as its own, and how far slip spreads a line, as a share of it.
SIDEBANDS, WANDER = 4, 1e-3
# A comb that stands this far below a typical one, or below another fault's, is as silent as any.
SILENT = -1.0


@dataclass(frozen=True, kw_only=True)
class PartEvidence:
    """Of one fault: by how much the evidence of its comb exceeds that of a typical comb of the record.

    `found_hz` is its fundamental, `false_alarm` the chance that a meaningless comb is as strong. None where the comb is
    out of the record's reach, `false_alarm` also where nothing is left to rank it among.
    """

    fault: Fault
    found_hz: float | None
    excess: float | None
    false_alarm: float | None


@dataclass(frozen=True, kw_only=True)
class FaultEvidence:
    """Of all faults, and of the strongest comb that neither they nor the shaft explain: excess and order.

    Where that comb is stronger than every fault's, it is that of the whole record; else that of what is left without
    the lines of the strongest fault.
    """

    parts: tuple[PartEvidence, ...]
    unexplained: float
    unexplained_order: float | None

    @property
    def features(self) -> tuple[float, ...]:
        """What classes are told by: of each fault its comb's excess over any other's, then that of the unexplained one.

        None is below `SILENT`. Any other comb is another fault's, the unexplained one or a typical one. The last
        feature is the unexplained comb's excess, where a fault's is stronger the difference to it.
        """
        excess = [SILENT if part.excess is None else part.excess for part in self.parts]
        others = [max(0.0, self.unexplained, *excess[:n], *excess[n + 1 :]) for n in range(len(excess))]
        highest = max(0.0, *excess)
        last = self.unexplained if self.unexplained > highest else self.unexplained - highest
        own = (e - other for e, other in zip(excess, others, strict=True))
        return tuple(max(SILENT, value) for value in (*own, last))


def fault_evidence(analysis: Analysis) -> FaultEvidence:
    """The evidence of an analysed record, about the speed that its analysis found."""
    speed = analysis.speed
    families = families_of(analysis.bearing, speed.value_hz)
    relative = analysis.bearing.largest_slip + speed.ci95_hz / speed.value_hz
    record = whitened_periodogram(analysis.processed, analysis.bearing, speed)
    combs = _combs(record, speed)
    meaningless = means_nothing(combs.frequency_hz, relative, families, speed)
    typical = combs.typical(relative)
    parts = []
    for fault, family in zip(DEFECTS, families, strict=False):
        evidence, found_hz = combs.highest(family.kinematic_hz, relative)
        placebos = combs.placebos(meaningless, family.kinematic_hz, relative)
        chance = math.exp(-neg_log_rank(evidence, placebos))
        reached = not math.isnan(evidence)
        parts.append(
            PartEvidence(
                fault=fault,
                found_hz=found_hz if reached else None,
                excess=evidence - typical if reached else None,
                false_alarm=None if math.isnan(chance) else chance,
            )
        )
    strongest = max(parts, key=lambda part: SILENT if part.excess is None else part.excess)
    unexplained, order = _strongest_unexplained(combs, relative, analysis)
    if strongest.found_hz is not None and unexplained <= max(0.0, strongest.excess or 0.0):
        rest = _without(record, strongest.found_hz, speed.value_hz)
        unexplained, order = _strongest_unexplained(_combs(rest, speed), relative, analysis)
    return FaultEvidence(parts=tuple(parts), unexplained=unexplained, unexplained_order=order)


def _combs(record: Periodogram, speed: ShaftSpeed) -> CombSpectrum:
    return CombSpectrum.of(record, LEAST_ORDER * speed.value_hz, HARMONICS)


def _without(record: Periodogram, line_hz: float, shaft_hz: float) -> Periodogram:
    """The record with the harmonics of a line and their sidebands at the shaft's rate masked."""
    number = np.arange(1, math.floor(record.limit_hz / line_hz) + 2, dtype=np.float64)[:, None]
    centre = number * line_hz + np.arange(-SIDEBANDS, SIDEBANDS + 1)[None, :] * shaft_hz
    return record.masking(centre.ravel(), np.broadcast_to(number * line_hz * WANDER, centre.shape).ravel())


def _strongest_unexplained(combs: CombSpectrum, relative: float, analysis: Analysis) -> tuple[float, float | None]:
    """Excess over a typical comb and order of the strongest fundamental that means nothing in this bearing."""
    speed = analysis.speed
    families = families_of(analysis.bearing, speed.value_hz)
    meaningless = means_nothing(combs.frequency_hz, relative / APART, families, speed)
    if not meaningless.any():
        return 0.0, None
    best = int(np.argmax(np.where(meaningless, combs.evidence, -np.inf)))
    return float(combs.evidence[best]) - combs.typical(relative), float(combs.frequency_hz[best]) / speed.value_hz
