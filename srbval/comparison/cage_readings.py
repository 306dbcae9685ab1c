"""Cage ratio (cage speed over shaft speed) of every record of the rig; theory: "Cage ratio of a record".

The fault lines of a damaged race, BPFO or BPFI with its harmonics, are read in the squared envelope, in the band of
`BANDS` in which the first harmonic is highest over the noise. The passage lines, multiples of BPFO in the vibration
itself, are caused by passing rollers, also in a healthy bearing. They are used only if they are improbable as noise and
stronger than most sets of multiples of a meaningless frequency (`rank_line`). If both readings agree within
their intervals, the more precise one is used, otherwise the reading of the fault lines.
"""

import dataclasses
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.special

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.reading.families import families_of, rank_line, window_share
from srbval.reading.pipeline import LEAST_REVOLUTIONS, Tracking, choose_tracking, one_signal, periodogram_of, process
from srbval.recordings import Recording, ShaftSpeed
from srbval.recordings.speed import RPM_PER_HZ
from srbval.signal import NORMAL_95, LineReading, Periodogram, is_improbable, read_comb

# Bands of the paper for signals of the rig and of the model, and a band that spans both [Hz].
BANDS = ((1400.0, 2800.0), (500.0, 1500.0), (400.0, 3150.0))
RECORD_PARTS = 4  # parts of a record in which the passage lines are read, for the scatter of their frequency


@dataclass(frozen=True, kw_only=True)
class CageReading:
    """Cage ratio c of one record: cage speed divided by shaft speed.

    c varies with time; `reading_u` is the standard uncertainty of reading its long-term mean, `speed_u` the standard
    uncertainty due to the shaft speed. `per_speed` is the derivative of c with respect to the relative error of the
    shaft speed: -c if c was read from BPFO, 1 - c if from BPFI. `read_from` names the lines and the signal that were
    read, `band_hz` is their frequency band.
    """

    record: str
    state: Fault
    nominal_rpm: float
    shaft_rpm: float
    ratio: float
    reading_u: float
    speed_u: float
    per_speed: float
    read_from: str
    band_hz: tuple[float, float]


def cage_readings(recordings: Iterable[Recording], bearing: Bearing) -> tuple[CageReading, ...]:
    """Read the cage ratio of every recording that permits it (see `cage_reading`); sorted by nominal speed."""
    read = [one for recording in recordings if (one := cage_reading(recording, bearing)) is not None]
    return tuple(sorted(read, key=lambda one: (one.nominal_rpm, one.state, one.record)))


def cage_reading(recording: Recording, bearing: Bearing) -> CageReading | None:
    """Read the cage ratio of a record.

    None if no line is detected, the bearing's state is unknown, the shaft makes less than `LEAST_REVOLUTIONS`, or no
    speed signal covers the whole record.
    """
    speed, state = recording.speed, recording.state
    if speed is None or state is None:
        return None
    tracking = choose_tracking(recording, bearing, speed)
    if not tracking.used or recording.seconds * speed.value_hz < LEAST_REVOLUTIONS:
        return None
    of_fault = _read_fault(recording, bearing, speed, tracking) if state in RACE_DEFECTS else None
    passages = _read_passages(recording, bearing, speed, tracking)
    if of_fault is None or passages is None:
        return of_fault or passages
    agree = abs(of_fault.ratio - passages.ratio) <= NORMAL_95 * math.hypot(of_fault.reading_u, passages.reading_u)
    return passages if agree and passages.reading_u < of_fault.reading_u else of_fault


def _read_fault(recording: Recording, bearing: Bearing, speed: ShaftSpeed, tracking: Tracking) -> CageReading | None:
    """Read the cage ratio from the fault lines of a damaged race in the envelope; None if they are not detected."""
    family = next(f for f in families_of(bearing, speed.value_hz) if recording.state and f.name == recording.state.line)
    line_hz, half_hz = family.kinematic_hz, window_share(bearing, speed) * family.kinematic_hz
    clearest, clearest_hz = None, BANDS[0]
    for band_hz in BANDS:
        record = periodogram_of(process(recording, band_hz=band_hz, tracking=tracking), bearing, speed)
        reading = read_comb(record, line_hz, half_hz, period_s=1 / speed.value_hz, sideband_hz=family.sideband_hz)
        if reading and reading.detected and (clearest is None or reading.snr[0] > clearest.snr[0]):
            clearest, clearest_hz = reading, band_hz
    name = f"{family.name} comb, envelope"
    return None if clearest is None else _cage_reading_of(recording, bearing, clearest, name, clearest_hz)


def _read_passages(recording: Recording, bearing: Bearing, speed: ShaftSpeed, tracking: Tracking) -> CageReading | None:
    """Read the cage ratio from the multiples of BPFO caused by passing rollers; None if they are not detected.

    The 95 % interval is that of the mean over `RECORD_PARTS` parts of the record by Student's t.
    """
    band_hz, signal = BANDS[-1], one_signal(recording)
    families = families_of(bearing, speed.value_hz)
    family = next(f for f in families if f.name == Fault.OUTER.line)
    vibration = tracking.resample(signal - signal.mean(), recording.fs_hz, 0.0)
    record = Periodogram.of(vibration, recording.fs_hz, limit_hz=band_hz[1], shaft_hz=speed.value_hz)
    line_hz, half_hz = family.kinematic_hz, window_share(bearing, speed) * family.kinematic_hz
    count = math.floor(band_hz[1] / line_hz)
    reading = read_comb(record, line_hz, half_hz, period_s=None, harmonics=count)
    ranks = None if reading is None else rank_line(family, reading, record, families, speed)
    if reading is None or ranks is None or not is_improbable(reading.noise_false_alarm, ranks[0]):
        return None
    found_hz = []
    for part in np.array_split(vibration, RECORD_PARTS):
        of_part = Periodogram.of(part, recording.fs_hz, limit_hz=band_hz[1], shaft_hz=speed.value_hz)
        of_part = dataclasses.replace(of_part, masks_hz=of_part.masks_hz[:0])  # masks are wider in a part
        own = read_comb(of_part, reading.found_hz, of_part.bin_hz / 2, period_s=None, harmonics=count)
        if own is None:
            return None
        found_hz.append(own.found_hz)
    ci95_hz = float(scipy.special.stdtrit(RECORD_PARTS - 1, 0.975) * np.std(found_hz, ddof=1)) / math.sqrt(RECORD_PARTS)
    reading = dataclasses.replace(reading, ci95_hz=ci95_hz)
    return _cage_reading_of(recording, bearing, reading, f"{family.name} multiples, vibration", band_hz)


def _cage_reading_of(
    recording: Recording, bearing: Bearing, reading: LineReading, read_from: str, band_hz: tuple[float, float]
) -> CageReading:
    """Convert the frequency of a line, `reading`, to a cage ratio; `read_from` begins with the name of the line."""
    speed = recording.known_speed
    hz_per_ratio = bearing.rolling_elements * speed.value_hz
    share = reading.found_hz / hz_per_ratio
    inner = read_from.startswith(Fault.INNER.line or "")
    per_speed = share if inner else -share
    return CageReading(
        record=Path(recording.file or recording.name).name,
        state=recording.state or Fault.HEALTHY,
        nominal_rpm=recording.nominal_rpm or RPM_PER_HZ * speed.value_hz,
        shaft_rpm=RPM_PER_HZ * speed.value_hz,
        ratio=1 - share if inner else share,
        reading_u=reading.ci95_hz / NORMAL_95 / hz_per_ratio,
        speed_u=abs(per_speed) * speed.ci95_hz / NORMAL_95 / speed.value_hz,
        per_speed=per_speed,
        read_from=read_from,
        band_hz=band_hz,
    )
