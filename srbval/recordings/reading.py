"""Contents of a file as interpreted by `recognise`, before the user's settings are applied."""

import functools
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.raw import LONG_SAMPLES, blocks_of, printable
from srbval.recordings.recording import Origin, SourceFacts
from srbval.recordings.times import TimeColumn
from srbval.recordings.units import CONVERTER_COUNTS, OTHER_QUANTITIES, REVOLUTIONS, SPEED_HZ, UNITS, UNKNOWN

N_PER_KN = 1e3
MIN_CLIPPED_IN_ROW, MIN_CLIPPED_TOTAL = 3, 10  # equal samples at an extreme, more than a vibration has there
# Least ratio of the samples at the extreme to the samples next to it (within this share of the range, or at the next
# value). A coarsely digitised sine has a ratio of 2.4; a sine sampled only at its peaks has no samples next to them.
PILED_UP, NEAR = 3, 0.01
SHORTEST_HOLD = 8  # samples; known recordings repeat a value three times at most
COARSE, LONG_HOLD = 2.5, 1000  # usual change [digital steps] below which only long holds count [samples]
MAX_CHANCE_HOLDS = 1e-3  # expected number of such runs in a record


def scaled(value: float | str | None, factor: float) -> float | None:
    """Multiply `value` by `factor`; None remains None."""
    return None if value is None else float(value) * factor


@dataclass(frozen=True, kw_only=True, eq=False)
class Channel:
    """Channel with samples [n] as stored (float64, or float32 if long); samples times `factor` are in `unit`.

    If `unit` is None, the user must state it; `unknown_unit` is then the text in the file that is not a known unit. If
    `unit` is ``unknown``, the description of the data set or the user states that the unit is not known. With
    `whole_numbers` the samples are counts of an A/D converter of unknown scale. A channel with a `problem` must not be
    analysed.
    """

    samples: FloatArray
    unit: str | None = None
    bearing: str | None = None
    band_hz: tuple[float, float] | None = None
    state: Fault | None = None
    variable: str | None = None
    cautions: tuple[str, ...] = ()
    factor: float = 1.0
    fs_hz: float | None = None
    whole_numbers: bool = False
    unknown_unit: str | None = None
    problem: str | None = None

    @property
    def scale_missing(self) -> bool:
        """True if a unit is stated but not the factor from the samples to this unit."""
        return self.whole_numbers and self.unit not in (None, UNKNOWN, CONVERTER_COUNTS)

    @property
    def rotates(self) -> bool:
        """True if the samples are the speed or the angle of a rotation, which is not a vibration."""
        return self.unit in SPEED_HZ or self.unit in REVOLUTIONS

    @functools.cached_property
    def vibrates(self) -> bool:
        """True if the samples may be a vibration: they rise and fall, and their unit denotes no other quantity."""
        first, last = self.samples[:-1], self.samples[1:]
        is_other = self.rotates or self.unit in OTHER_QUANTITIES
        return not is_other and bool((last > first).any()) and bool((last < first).any())

    @property
    def recording_unit(self) -> str:
        """Unit to which a recording converts the samples."""
        unit = UNKNOWN if self.scale_missing else self.unit or UNKNOWN
        return UNITS.get(unit, (unit, 1.0))[0]

    def converted(self) -> FloatArray:
        """Samples in `recording_unit`; a short signal is copied, as a view would keep the whole file in memory."""
        factor = 1.0 if self.scale_missing else self.factor * UNITS.get(self.unit or UNKNOWN, ("", 1.0))[1]
        if factor != 1.0:
            return self.samples * factor
        return np.array(self.samples) if self.samples.size < LONG_SAMPLES else self.samples


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading(SourceFacts):
    """Interpreted contents of a file; `channel` and `fs_hz` are None if the file does not determine them.

    `rate_problem` is the reason why the sampling rate is not determined. ``times[n]`` are the times of
    all channels with n samples. `speed_problem` is the reason not to trust the speed in the file; only a speed stated
    by the user resolves it.
    """

    channels: Mapping[str, Channel]
    origin: Origin = Origin.MEASURED
    fs_hz: float | None = None
    rate_problem: str | None = None
    times: Mapping[int, TimeColumn] = field(default_factory=dict)
    speed_problem: str | None = None
    name: str | None = None

    @property
    def vibrations(self) -> tuple[str, ...]:
        """Names of usable channels: vibrations without a `problem`; if none, all but rotation speeds and angles."""
        sound = tuple(name for name, channel in self.channels.items() if channel.vibrates and not channel.problem)
        return sound or tuple(name for name, channel in self.channels.items() if not channel.rotates)

    @property
    def main(self) -> Channel:
        """Channel to analyse, or the first channel that may be analysed if none is chosen yet."""
        names = self.axes or self.vibrations or tuple(self.channels)
        return self.channels[names[0] if self.channel is None else self.channel]

    @property
    def time(self) -> TimeColumn | None:
        """Times of the samples of the channel to analyse; None if the file contains none."""
        return self.times.get(self.main.samples.size)

    def with_samples(self, change: Callable[[FloatArray], FloatArray], **changes: Any) -> "Reading":
        """Replace samples by `change(samples)`, and fields by `changes`, in all channels as long as `main`."""
        size = self.main.samples.size
        alike = {name: channel for name, channel in self.channels.items() if channel.samples.size == size}
        changed = {name: replace(c, samples=change(c.samples), **changes) for name, c in alike.items()}
        return replace(self, channels={**self.channels, **changed})

    def check_main(self) -> None:
        """Raise `DataError` if the channel to analyse has a problem, or if every channel that may be chosen has one."""
        names = self.axes or ((self.channel,) if self.channel is not None else self.vibrations)
        problems = [self.channels[name].problem for name in names]
        if problems and all(problems):
            raise DataError(str(problems[0]))

    def all_cautions(self) -> tuple[str, ...]:
        """Cautions about the file and the channel to analyse, or about every channel if none is chosen yet."""
        if self.channel is not None:
            return self.cautions + self.channels[self.channel].cautions
        return self.cautions + tuple(f"{printable(n)}: {c}" for n, ch in self.channels.items() for c in ch.cautions)


def sample_cautions(samples: FloatArray) -> tuple[str, ...]:
    """Cautions about clipped and repeated samples, with the number of these samples; none for a constant signal.

    A long signal is checked in blocks; the cautions describe the first affected block.
    """
    for first, block in blocks_of(samples):
        if said := _block_cautions(block, first, samples.size):
            where = f", in the block from sample {first} on" if block.size < samples.size else ""
            return tuple(one + where for one in said)
    return ()


def _block_cautions(samples: FloatArray, begin: int, total: int) -> tuple[str, ...]:
    """Cautions about one block of a signal of `total` samples; `begin` is the index of the block's first sample."""
    if samples.size < 2 or samples.min() == samples.max():
        return ()
    starts = np.concatenate(([0], np.flatnonzero(samples[1:] != samples[:-1]) + 1))
    lengths, values = np.diff(starts, append=samples.size), samples[starts]
    said, clipped = [], np.zeros(values.size, dtype=bool)
    for extreme in (values.max(), values.min()):
        off = np.abs(values - extreme)
        at = off == 0
        near, following = ~at & (off <= NEAR * off.max()), off == off[~at].min()
        count, longest = int(lengths[at].sum()), lengths[at].max()
        piled_up = count >= PILED_UP * lengths[near | following].sum()
        if piled_up and (longest >= MIN_CLIPPED_IN_ROW or (count >= MIN_CLIPPED_TOTAL and near.any())):
            said.append(f"clipped: {_share(count, samples)} at {extreme:.6g}, up to {longest} in a row")
            clipped |= at
    held = ~clipped & (lengths >= _shortest_unlikely_run(lengths, values, total))
    if held.any():
        first = int(np.argmax(lengths * held))
        said.append(
            f"repeated instead of measured: {_share(int(lengths[held].sum()), samples)} in {held.sum()} runs, "
            f"the longest {lengths[first]} times {values[first]:.6g} from sample {begin + starts[first]} on"
        )
    return tuple(said)


def _share(count: int, samples: FloatArray) -> str:
    return f"{count} of {samples.size} samples ({100 * count / samples.size:.2g} %)"


def _shortest_unlikely_run(lengths: NDArray[np.intp], values: FloatArray, total: int) -> float:
    """Least number of successive equal samples that is no coincidence, from `lengths` and `values` of all sequences."""
    again, steps = float(np.mean(lengths > 1)), np.abs(np.diff(values))
    if again >= 1:
        return math.inf
    by_chance = math.log(total / MAX_CHANCE_HOLDS) / -math.log(again) if again else 0.0
    return max(LONG_HOLD if np.median(steps) < COARSE * steps.min() else SHORTEST_HOLD, by_chance + 1)
