"""What runs are compared by: cage speed, noise floor of the envelope, vibration in the band, harmonic pattern.

And which harmonic of a fault line is missing: the paper's remark on Figure 12. A rectangular pulse of length tau,
repeated at f, lacks its harmonic 1 / (f tau) (the paper's eq. 20). Measured on envelope spectra the missing one is
found where the heights change sign.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.planar import ring_kernel
from srbval.models.planar.ring import make_ring
from srbval.models.run import Run
from srbval.models.sensor import band_rms, hann
from srbval.reading.analyse import analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ, process
from srbval.recordings import recording_from_run
from srbval.scene import Scene
from srbval.signal import Spectrum

FLOOR_HZ = (60.0, 90.0)  # below BPFO and BPFI, above nothing but multiples of the shaft speed
HARMONICS = 5
HARMONIC_REACH = 2.0  # resolutions either side of a harmonic in which its top is looked for
BLOCKS = 8  # parts of a run whose cage speeds are compared
PADDING = 4  # times the record's length
REACH = 1.0  # resolutions either side of a line in which its top is looked for
PULSE_HARMONICS = 10
FELT = 0.01  # of a pulse's height: where it begins and ends
WIDE_BAND_HZ = (300.0, 3300.0)  # preserves a pulse's shape: more than ten times BPFO on either side of its middle
LEAST_SECONDS = 0.3  # of a record that the pipeline can say something about


@dataclass(frozen=True, kw_only=True)
class Measures:
    """One run in a few numbers.

    `cage_ratio` mean cage over shaft speed, Hann-weighted (see `smooth_mean`); `cage_scatter` its standard error from
    the run's parts, relative; `defect_hz` BPFO or BPFI of that cage speed, None without defect; `noise_floor` see
    `noise_floor`; `band_rms_m_s2` of the outer ring's vertical acceleration; `harmonics` heights of the defect line's
    first harmonics over the first one's, None without defect. `noise_floor` is None for a record too short.
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
        pattern = None if defect_hz is None else harmonic_pattern(processed.spectrum, defect_hz)
    return Measures(
        seconds=run.seconds,
        cage_ratio=ratio,
        cage_scatter=scatter(run.cage_rad_s),
        defect_hz=defect_hz,
        noise_floor=floor,
        band_rms_m_s2=band_rms(run.acceleration_m_s2[:, 1], run.scene.output_rate_hz, SIMULATED_BAND_HZ),
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


def harmonic_pattern(spectrum: Spectrum, defect_hz: float) -> tuple[float, ...]:
    """Heights of the first `HARMONICS` multiples of `defect_hz` in an envelope's spectrum, over the first one's."""
    reach = HARMONIC_REACH * spectrum.resolution_hz
    heights = []
    for k in range(1, HARMONICS + 1):
        near = np.abs(spectrum.frequency_hz - k * defect_hz) <= reach
        heights.append(float(spectrum.amplitude[near].max()))
    return tuple(height / heights[0] for height in heights)


def line_heights(envelope: FloatArray, fs_hz: float, lines_hz: Sequence[float]) -> list[float]:
    """Height of an envelope's spectrum at each line, its top within `REACH` resolutions.

    Hann window and zero padding: without them a line between two bins reads up to a third low. A sine of amplitude a
    reads a.
    """
    length = scipy.fft.next_fast_len(PADDING * envelope.size, real=True)
    window = np.sin(np.pi * (np.arange(envelope.size) + 0.5) / envelope.size) ** 2
    spectrum = np.abs(scipy.fft.rfft((envelope - envelope.mean()) * window, n=length)) * (2 / window.sum())
    bin_hz, reach_hz = fs_hz / length, REACH * fs_hz / envelope.size
    heights = []
    for line_hz in lines_hz:
        low, high = math.ceil((line_hz - reach_hz) / bin_hz), math.floor((line_hz + reach_hz) / bin_hz)
        heights.append(float(spectrum[max(low, 0) : high + 1].max()))
    return heights


def pulse_share(scene: Scene) -> float:
    """Pulse length over the passing period, f tau of the paper's eq. (20): the same at every speed.

    The force pulse is that of the scene's first defect under a roller in the middle of the load zone, the ring held,
    from where it is first felt to where it is last. `ConfigurationError` for a defect that is on no race.
    """
    if scene.defect.kind not in RACE_DEFECTS:
        raise ConfigurationError(f"defect {scene.defect.kind.scene_word}: only a race's defect has a pulse length.")
    ring = make_ring(scene, load_bearing(scene.bearing))
    kernel, zone = ring.kernel, np.array([math.cos(scene.load.zone_rad), math.sin(scene.load.zone_rad)])
    pulse = kernel.bumps[0, round((-float(ring.balance_m() @ zone) - kernel.bump_start) / kernel.bump_step)]
    felt = np.flatnonzero(pulse > FELT * pulse.max())
    length_m = 2 * float(felt[-1]) * float(kernel.defects[0, ring_kernel.POSITION_STEP])
    return length_m / (2 * math.pi * float(kernel.defects[0, ring_kernel.RACE_RADIUS]) / kernel.rollers)


def missing_of(run: Run) -> dict[str, float | None]:
    """The harmonic that a usable run with a race's defect lacks: `by_sinc` of its `pulse_share`, and as measured.

    `wide_band` and `paper_band`: a fraction where the heights pass zero between two harmonics, None where none of the
    first `PULSE_HARMONICS` is missing.
    """
    share = pulse_share(run.scene)
    bands = {"wide_band": WIDE_BAND_HZ, "paper_band": SIMULATED_BAND_HZ}
    measured = {name: missing_harmonic(harmonic_heights(run, band_hz)) for name, band_hz in bands.items()}
    return {"pulse_share": share, "by_sinc": 1 / share, **measured}


def harmonic_heights(run: Run, band_hz: tuple[float, float]) -> list[float]:
    """Heights of the first `PULSE_HARMONICS` of the run's fault line, demodulated from a band, over the first one's."""
    bearing = load_bearing(run.scene.bearing)
    found = analyse(recording_from_run(run), bearing=bearing, band_hz=band_hz)
    line = found.line_of(run.scene.defect.kind)
    first = line.found_hz if line.found_hz is not None else line.kinematic_hz
    heights = line_heights(
        found.processed.envelope, found.processed.fs_hz, [k * first for k in range(1, PULSE_HARMONICS + 1)]
    )
    return [height / heights[0] for height in heights]


def missing_harmonic(heights: Sequence[float]) -> float | None:
    """Where the first lobe of a harmonic pattern ends: the first local minimum, or between it and a neighbour.

    Heights are moduli, so a lobe that passes zero turns up again behind it; the change of sign is put where the slopes
    on both sides agree best.
    """
    for i in range(1, len(heights) - 1):
        before, here, after = heights[i - 1], heights[i], heights[i + 1]
        if here > before or here > after:
            continue
        behind = abs((before - here) - (here + after))  # passes zero behind this one
        ahead = abs((before + here) - (after - here))  # passed it ahead of this one
        if behind <= ahead:
            return i + 1 + here / (here + after)
        return i + before / (before + here)
    return None
