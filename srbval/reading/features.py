"""Features of one channel such as RMS, kurtosis and velocity, and levels in records too short to search for lines."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Bearing
from srbval.reading.analyse import Analysis
from srbval.reading.families import families_of
from srbval.reading.lines import Line
from srbval.reading.pipeline import BandChoice, one_signal, process, whole_band_of
from srbval.recordings import Recording
from srbval.recordings.units import ACCELERATION_UNIT, DISPLACEMENT_UNIT, VELOCITY_UNIT
from srbval.signal.envelope import END_PERIODS

# Power of 2 pi f that makes a velocity of a unit, and the factor from there to m/s.
VELOCITIES = {ACCELERATION_UNIT: (-1, 1.0), VELOCITY_UNIT: (0, 1e-3), DISPLACEMENT_UNIT: (1, 1e-6)}
HIGHEST_HZ = 1000.0
SLOW_RPM, SLOW_HZ, FAST_HZ = 600.0, 2.0, 10.0  # ISO 20816-3: from 2 Hz for machines slower than 600 rpm, else 10 Hz
NOISE_OFFSETS = (-2.0, -1.5, 1.5, 2.0)  # places of the neighbourhood of a snapshot's line, in widths of a line
POOLED_REVOLUTIONS = 30.0
LEAST_PERIODS = 10  # of the lowest frequency in the record, for its amplitude to mean something


def features_of(analysis: Analysis) -> dict[str, Any]:
    """Compute the features of the analysed channel without its mean; `velocity_missing` explains a missing velocity.

    The features of a long record describe the whole record, except `band_rms`, which describes the analysed part.
    """
    recording, done = analysis.recording, analysis.processed
    band_hz = (SLOW_HZ if 60 * analysis.speed.value_hz < SLOW_RPM else FAST_HZ, HIGHEST_HZ)
    missing = ""
    if recording.unit not in VELOCITIES:
        missing = f"the unit is {recording.unit}: state what the samples are (--unit, --scale, --sensitivity)"
    elif recording.fs_hz <= 2 * HIGHEST_HZ:
        missing = f"sampled at {recording.fs_hz:g} Hz the record does not contain the band to {HIGHEST_HZ:g} Hz"
    elif done.whole.size < LEAST_PERIODS * recording.fs_hz / band_hz[0]:
        missing = f"the record lasts {recording.seconds:.3g} s, less than {LEAST_PERIODS} periods of {band_hz[0]:g} Hz"
    powers, peak, parts = list[tuple[float, float, float]](), 0.0, round(recording.samples / done.whole.size)
    for first, end in itertools.pairwise(np.linspace(0, recording.samples, parts + 1).astype(int).tolist()):
        signal = one_signal(recording.part(first, end))
        signal = signal - signal.mean()
        velocity = 0.0 if missing else velocity_rms(signal, recording.fs_hz, band_hz, recording.unit)
        powers.append((float(np.var(signal)), float(np.mean(np.square(signal**2))), velocity**2))
        peak = max(peak, float(np.abs(signal).max()))
    square, fourth, velocity = np.mean(powers, axis=0).tolist()
    return {
        "unit": recording.unit,
        "rms": math.sqrt(square),
        "peak": peak,
        "crest": peak / math.sqrt(square),
        "kurtosis": fourth / square**2,
        "band_rms": done.scale * math.sqrt(float(np.mean(done.squared)) / 2),
        "velocity_rms_mm_s": None if missing else 1e3 * math.sqrt(velocity),
        "velocity_band_hz": band_hz,
        "velocity_missing": missing,
    }


def velocity_rms(
    samples: FloatArray, fs_hz: float, band_hz: tuple[float, float], unit: str = ACCELERATION_UNIT
) -> float:
    """RMS of the velocity in a band [m/s], under a Hann window, from samples [n] in m/s2, mm/s or µm."""
    window, (exponent, factor) = np.hanning(samples.size), VELOCITIES[unit]
    spectrum = np.fft.rfft(window * (samples - samples.mean()))
    frequency = np.fft.rfftfreq(samples.size, 1 / fs_hz)
    within = (frequency >= band_hz[0]) & (frequency <= band_hz[1])
    power = 2 * np.abs(spectrum[within] * (2 * math.pi * frequency[within]) ** exponent) ** 2
    return factor * math.sqrt(float(power.sum()) / samples.size / float((window**2).sum()))


def read_short(recording: Recording, bearing: Bearing, band: BandChoice | None = None) -> Analysis:
    """Analyse a snapshot, a record too short to search for lines, in a `band` (default: the whole band).

    `depth` of a line is the modulation of the squared envelope at its kinematic frequency, `snr` its power over the
    power nearby. A shaft harmonic closer to the line than 2 / duration cannot be separated from it.
    """
    band, speed = band or whole_band_of(recording.fs_hz), recording.known_speed
    done = process(recording, band_hz=band.band_hz, ends_s=END_PERIODS / (band.band_hz[1] - band.band_hz[0]))
    time_s, window = np.arange(done.squared.size) / done.squared_fs_hz, np.hanning(done.squared.size)
    modulation, lines = window * (done.squared / done.squared.mean() - 1), []
    for family in families_of(bearing, speed.value_hz)[: len(DEFECTS)]:
        at_hz = family.kinematic_hz + 2 / done.seconds * np.array((0.0, *NOISE_OFFSETS))
        waves = np.exp(-2j * math.pi * np.outer(at_hz, time_s))
        power, *beside = np.abs(2 * waves @ modulation / window.sum()) ** 2
        depth, snr, kinematic_hz = math.sqrt(power), float(power / np.mean(beside)), family.kinematic_hz
        lines.append(Line(name=family.name, harmonic=1, kinematic_hz=kinematic_hz, depth=depth, snr=snr))
    return Analysis(processed=done, bearing=bearing, lines=tuple(lines), speed=speed, recording=recording, band=band)


def pool_snapshots(snapshots: Sequence[Mapping[str, Any]], groups: int) -> Iterator[dict[str, Any]]:
    """Average the powers of short records in groups of successive records; yields one document for each group.

    There are `groups` groups, or more if each then still has about `POOLED_REVOLUTIONS` shaft revolutions, but never
    more groups than records.
    """
    turns = sum(one["seconds"] * one["shaft_hz"]["value"] for one in snapshots)
    count = min(len(snapshots), max(groups, round(turns / POOLED_REVOLUTIONS)))
    for own in np.array_split(np.array(snapshots, dtype=object), count):
        lines = []
        for line in zip(*(one["lines"] for one in own), strict=True):
            power = float(np.mean([each["depth"] ** 2 for each in line]))
            beside = float(np.mean([each["depth"] ** 2 / each["snr"] for each in line]))
            lines.append(line[-1] | {"depth": math.sqrt(power), "snr": len(own) * power / beside})
        levels = {
            name: math.sqrt(float(np.mean([one["features"][name] ** 2 for one in own]))) for name in ("rms", "band_rms")
        }
        yield {**own[-1], "features": own[-1]["features"] | levels, "lines": lines}
