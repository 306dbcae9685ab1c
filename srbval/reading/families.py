"""A bearing's families of lines and the order in which they are read.

The strongest family is read first. Its harmonics and sidebands are masked before the next is read, and a
weaker line on a simple ratio of a stronger one is marked as explained by it: in several bearings three times
BPFO lies within one per cent of twice BPFI.
"""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Bearing
from srbval.reading.identity import identity_probability
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import LineReading, Periodogram, read_comb
from srbval.signal.false_alarm import APART, fundamentals, rank_among_placebos

HARMONICS = 5
# A peak less probably the line than this is taken for another's, and is nobody's baseline.
LEAST_IDENTITY, OTHER_LINE = 0.5, "another line: too far off for slip"
# Sidebands of a found line that are taken as its own when a weaker line is read.
_OWN_SIDEBANDS = 3
# Blocks of the phase wander last at least this many revolutions, or a line's sidebands leak into its phase.
_BLOCK_REVOLUTIONS = 2
# Placebos are drawn up to this factor from a family's own frequency, an octave to either side.
PLACEBO_REACH = 2.0
# A weaker line on one of these ratios of a stronger one's frequency is taken as part of it.
_RATIOS = [(up, down) for up in range(1, 5) for down in range(1, 5) if math.gcd(up, down) == 1]


@dataclass(frozen=True, kw_only=True)
class Family:
    """A line with harmonics and sidebands of one cause: its first harmonic by kinematics, and the sidebands' spacing.

    Spacing zero, no name: no sidebands are looked for.
    """

    name: str
    kinematic_hz: float
    sideband_hz: float = 0.0
    sideband_name: str = ""


@dataclass(frozen=True, kw_only=True)
class FamilyReading:
    """What was read of a family in `record`, where the lines of stronger families are masked.

    Its lines were looked for about `scale` times their kinematic frequencies: a nominal speed may be that far off.
    `explained_by` names what the peak is a line of, where it is not the family's own. `identity_probability` is that of
    the peak being the family's line, None where it does not stand out or the record is simulated.
    """

    family: Family
    reading: LineReading
    record: Periodogram
    scale: float
    explained_by: str | None
    identity_probability: float | None

    @property
    def detected(self) -> bool:
        """Whether the line is there and its own."""
        return self.reading.detected and self.explained_by is None


def window_share(bearing: Bearing, speed: ShaftSpeed) -> float:
    """Half width of the search window about a kinematic frequency, as a share of it: slip and the speed's interval.

    That of a nominal speed widens no window: several speeds are tried instead, see `speed_search`.
    """
    return bearing.largest_slip + (0.0 if speed.source is SpeedSource.NOMINAL else speed.ci95_hz / speed.value_hz)


def half_window_hz(frequency_hz: float, record: Periodogram, share: float) -> float:
    """Half width of the search window about a frequency [Hz], at least one bin."""
    return max(share * frequency_hz, record.bin_hz)


def highest_line_hz(bearing: Bearing, shaft_hz: float) -> float:
    """Highest frequency the readings of `bearing` need [Hz]."""
    highest = max(fault.line_order(bearing.orders) for fault in DEFECTS)
    return (HARMONICS * (1 + bearing.largest_slip) * highest + _OWN_SIDEBANDS) * shaft_hz


def families_of(bearing: Bearing, shaft_hz: float) -> tuple[Family, ...]:
    """Race, roller and cage families at a shaft speed [Hz], the cage last."""
    orders = bearing.orders
    faults = (
        Family(
            name=fault.line or "",
            kinematic_hz=fault.line_order(orders) * shaft_hz,
            sideband_hz=fault.sideband_order(orders) * shaft_hz,
            sideband_name=fault.sidebands or "",
        )
        for fault in DEFECTS
    )
    return (*faults, Family(name="FTF", kinematic_hz=orders.ftf * shaft_hz))


def find_families(
    record: Periodogram, bearing: Bearing, speed: ShaftSpeed, *, scale: float = 1.0, rank_all: bool = True
) -> dict[str, FamilyReading]:
    """Every family of `bearing` that `record`, a periodogram of the squared envelope, can show, by name.

    They are looked for about `scale` times kinematic; with a nominal speed the first detected line also settles the
    scale of the others, which stand there too but for slip. Each is ranked among placebos of the record it
    is read in, without `rank_all` only those that noise does not explain: what is detected is the same. The cage line
    is read by itself: its harmonics coincide with every other line's.
    """
    families = families_of(bearing, speed.value_hz)
    *waiting, cage = families
    share, settles = window_share(bearing, speed), speed.source is SpeedSource.NOMINAL
    found: list[FamilyReading] = []
    bare = record

    def read_all(record: Periodogram, waiting: Sequence[Family]) -> dict[Family, LineReading]:
        """Those that are in the record's reach, as read."""
        readings = {}
        for family in waiting:
            centre = scale * family.kinematic_hz
            reading = read_comb(
                record, centre, half_window_hz(centre, record, share), harmonics=HARMONICS,
                sideband_hz=family.sideband_hz, shortest_block_s=_BLOCK_REVOLUTIONS / speed.value_hz,
            )  # fmt: skip
            if reading is not None:
                readings[family] = reading
        return readings

    def judged(family: Family, reading: LineReading, within: Periodogram, stronger: list[FamilyReading]) -> None:
        """Add a reading to those found, with its rank, what explains it, and how probably it is the line."""
        centre, rank = scale * family.kinematic_hz, None
        if rank_all or reading.detected:
            placebo_hz = placebo_fundamentals(family, reading, within, families, speed, scale)
            rank = rank_among_placebos(within, centre, reading.half_window_hz, len(reading.snr), placebo_hz)
        reading = replace(reading, placebo_false_alarm=None if rank is None else rank.false_alarm)
        explained, identity = None, None
        if reading.detected:
            explained = _explained_by(reading, stronger, within.bin_hz)
            chance = reading.noise_false_alarm if rank is None else rank.tail_false_alarm
            # Simulated (the shaft is prescribed) there is no other machine, and how far off the line is the model's.
            if speed.source is not SpeedSource.PRESCRIBED:
                speed_ci95 = speed.ci95_hz / speed.value_hz
                identity = identity_probability(reading, centre, speed_ci95, chance, bearing.largest_slip)
        if identity is not None and identity < LEAST_IDENTITY:
            explained = explained or OTHER_LINE
        found.append(FamilyReading(
            family=family, reading=reading, record=within, scale=scale, explained_by=explained,
            identity_probability=identity,
        ))  # fmt: skip

    read = read_all(record, waiting)
    while read:
        # Lines that noise does not explain first, the deepest modulation before all.
        strongest = max(read, key=lambda f: read[f].depth if read[f].detected else 0.0)
        waiting.remove(strongest)
        judged(strongest, read.pop(strongest), record, found)
        if found[-1].detected:
            record = _without(record, found[-1])
            if settles:
                scale, settles = found[-1].reading.found_hz / strongest.kinematic_hz, False
            read = read_all(record, waiting)
    for family, reading in read_all(bare, [cage]).items():
        judged(family, reading, bare, [])
    return {one.family.name: one for one in found}


def placebo_fundamentals(
    family: Family, reading: LineReading, record: Periodogram, families: tuple[Family, ...], speed: ShaftSpeed,
    scale: float = 1.0,
) -> FloatArray:  # fmt: skip
    """Fundamentals [n] about that of `family` that mean nothing in this bearing, for `rank_among_placebos`.

    Within `PLACEBO_REACH` of it and with all lines of `reading` below the record's limit: see `is_placebo_order`.
    """
    centre = scale * family.kinematic_hz
    relative = reading.half_window_hz / centre
    highest = min(PLACEBO_REACH * centre, record.limit_hz / len(reading.snr) / (1 + relative))
    candidates = fundamentals(centre / PLACEBO_REACH, highest, relative)
    return np.asarray(candidates[is_placebo_order(candidates, relative, families, speed, scale)])


def is_placebo_order(
    candidates_hz: FloatArray, relative: float, families: tuple[Family, ...], speed: ShaftSpeed, scale: float = 1.0
) -> NDArray[np.bool_]:
    """Which fundamentals [n] mean nothing in this bearing.

    Those whose windows of half width `relative` share nothing with those about a harmonic of the shaft, a family, a
    sideband of one, or a simple ratio of one.
    """
    ratios = np.outer([f.kinematic_hz for f in families], [up / down for up, down in _RATIOS])
    sides = np.arange(-_OWN_SIDEBANDS, _OWN_SIDEBANDS + 1)
    sidebands = np.array([f.kinematic_hz + k * f.sideband_hz for f in families for k in sides])
    meant = np.sort(scale * np.concatenate((ratios.ravel(), sidebands[sidebands > 0])))
    above = np.clip(np.searchsorted(meant, candidates_hz), 1, meant.size - 1)
    near = np.minimum(*(np.abs(candidates_hz / meant[above - side] - 1) for side in (0, 1))) < APART * relative
    order = candidates_hz / (scale * speed.value_hz)
    near |= np.abs(order - np.rint(order)) < (APART * relative + speed.ci95_hz / speed.value_hz) * order
    return np.asarray(~near)


def _explained_by(reading: LineReading, stronger: list[FamilyReading], bin_hz: float) -> str | None:
    for other, (up, down) in itertools.product(stronger, _RATIOS):
        expected = other.reading.found_hz * up / down
        margin = bin_hz + math.hypot(reading.ci95_hz, other.reading.ci95_hz * up / down)
        if other.detected and abs(reading.found_hz - expected) <= margin:
            return f"{up}/{down} {other.family.name}"
    return None


def _without(record: Periodogram, found: FamilyReading) -> Periodogram:
    """The record with the harmonics of a found line, and their sidebands, masked."""
    line_hz = found.reading.found_hz
    number = np.arange(1, math.floor(record.limit_hz / line_hz) + 1)[:, None]
    side = np.arange(-_OWN_SIDEBANDS, _OWN_SIDEBANDS + 1)[None, :] * (found.family.sideband_hz > 0)
    centre = number * line_hz + side * found.family.sideband_hz
    width = np.broadcast_to(number * found.reading.ci95_hz, centre.shape)
    return record.masking(centre.ravel(), width.ravel())
