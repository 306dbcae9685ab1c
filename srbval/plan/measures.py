"""What runs are compared by: cage speed, noise floor of the envelope, vibration in the band, harmonic pattern."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.models.run import Run
from srbval.models.sensor import hann
from srbval.reading.pipeline import SIMULATED_BAND_HZ, process
from srbval.recordings import recording_from_run

FLOOR_HZ = (60.0, 90.0)  # below BPFO and BPFI, above nothing but multiples of the shaft speed
HARMONICS = 5
BLOCKS = 8  # parts of a run whose cage speeds are compared
PADDING = 4  # times the record's length
REACH = 1.0  # resolutions either side of a line in which its top is looked for
BAND = "{:g}-{:g}".format(*SIMULATED_BAND_HZ)  # name of the band among those of a run
LEAST_SECONDS = 0.3  # of a record that the pipeline can say something about


@dataclass(frozen=True, kw_only=True)
class Measures:
    """One run in a few numbers.

    `cage_ratio` mean cage over shaft speed, Hann-weighted (see `smooth_mean`); `cage_scatter` its standard error from
    the run's parts, relative; `defect_hz` BPFO or BPFI of that cage speed, None without defect; `noise_floor` see
    `noise_floor`; `band_rms_m_s2` along the sensor's axis, see `Run.band_rms_m_s2`; `harmonics` heights of the defect
    line's first harmonics over the first one's, None without defect. `noise_floor` is None for a record too short.
    """

    seconds: float
    cage_ratio: float
    cage_scatter: float
    defect_hz: float | None
    noise_floor: float | None
    band_rms_m_s2: float
    harmonics: tuple[float, ...] | None


def measure(run: Run) -> Measures:
    """Measure a run that went well; through the pipeline of every recording where that is defined."""
    ratio = smooth_mean(run.cage_rad_s) / (2 * math.pi * run.scene.shaft_hz)
    order = run.scene.defect.kind.passing_order(run.rolling_elements, ratio)
    defect_hz = None if order is None else order * run.scene.shaft_hz
    floor, pattern = None, None
    if run.seconds >= LEAST_SECONDS:
        processed = process(recording_from_run(run), band_hz=SIMULATED_BAND_HZ)
        floor = noise_floor(processed.envelope, processed.fs_hz)
        pattern = None if defect_hz is None else harmonic_pattern(processed.envelope, processed.fs_hz, defect_hz)
    return Measures(
        seconds=run.seconds,
        cage_ratio=ratio,
        cage_scatter=scatter(run.cage_rad_s),
        defect_hz=defect_hz,
        noise_floor=floor,
        band_rms_m_s2=run.band_rms_m_s2[BAND],
        harmonics=pattern,
    )


def smooth_mean(values: FloatArray) -> float:
    """Mean of `values` [n] under a Hann window.

    The cage's ripple at roller passing leaves 1/n in a plain mean of n periods, 1/n^3 in this one.
    """
    return float(np.average(values, weights=hann(values.size)))


def scatter(values: FloatArray) -> float:
    """Standard error of the mean of `values` from the means of `BLOCKS` parts, relative to the mean."""
    means = np.array([smooth_mean(part) for part in np.array_split(values, BLOCKS)])
    return float(means.std(ddof=1) / math.sqrt(BLOCKS) / abs(means.mean()))


def noise_floor(envelope: FloatArray, fs_hz: float) -> float:
    """Median height of an envelope's spectrum between 60 and 90 Hz over the envelope's mean.

    With a Hann window: without one, the leakage of the strong lines about the range would hide the floor of a clean
    run. Heights are such that white noise has those of a plain amplitude spectrum. Broadband noise stands lower in a
    longer record, by its square root: compare equal durations only.
    """
    window, mean = hann(envelope.size), float(envelope.mean())
    lines = np.abs(np.asarray(scipy.fft.rfft((envelope - mean) * window)))
    frequency = np.arange(lines.size) * fs_hz / envelope.size
    inside = (frequency >= FLOOR_HZ[0]) & (frequency <= FLOOR_HZ[1])
    as_plain = 2 / math.sqrt(envelope.size * float((window**2).sum()))
    return float(np.median(lines[inside])) * as_plain / mean


def harmonic_pattern(envelope: FloatArray, fs_hz: float, first_hz: float, count: int = HARMONICS) -> tuple[float, ...]:
    """Heights of the first `count` multiples of a frequency in an envelope's spectrum, over the first one's."""
    heights = line_heights(envelope, fs_hz, [k * first_hz for k in range(1, count + 1)])
    return tuple(height / heights[0] for height in heights)


def line_heights(envelope: FloatArray, fs_hz: float, lines_hz: Sequence[float]) -> list[float]:
    """Height of an envelope's spectrum at each line, its top within `REACH` resolutions.

    Hann window and zero padding: without them a line between two bins reads up to a third low. A sine of amplitude a
    reads a.
    """
    length = scipy.fft.next_fast_len(PADDING * envelope.size, real=True)
    window = hann(envelope.size)
    spectrum = np.abs(scipy.fft.rfft((envelope - envelope.mean()) * window, n=length)) * (2 / window.sum())
    bin_hz, reach_hz = fs_hz / length, REACH * fs_hz / envelope.size
    heights = []
    for line_hz in lines_hz:
        low, high = math.ceil((line_hz - reach_hz) / bin_hz), math.floor((line_hz + reach_hz) / bin_hz)
        heights.append(float(spectrum[max(low, 0) : high + 1].max()))
    return heights
