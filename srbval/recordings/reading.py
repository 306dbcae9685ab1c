"""Contents of a file as interpreted by `recognise`, before the user's settings are applied."""

import functools
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.raw import LONG_SAMPLES, printable
from srbval.recordings.recording import Origin, SourceFacts
from srbval.recordings.times import TimeColumn
from srbval.recordings.units import CONVERTER_COUNTS, OTHER_QUANTITIES, REVOLUTIONS, SPEED_HZ, UNITS, UNKNOWN

N_PER_KN = 1e3


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
