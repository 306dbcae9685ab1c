"""Added noise at a stated signal-to-noise ratio, white or with the spectrum of a recording; detection under noise.

The study reads the fault lines of simulated bearings under added noise of stated ratios and spectra.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from statistics import median

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.errors import ConfigurationError, NumericsError
from srbval.models.run import RunStatus
from srbval.models.simulate import simulate
from srbval.progress import Progress, silent
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.registry import load_registered
from srbval.scene import paper_scene
from srbval.validation.analyse import analyse
from srbval.validation.lines import Line

WHITE = "white"
SEGMENT = 2048  # samples per Welch segment: smears the recording's lines, keeps the shape of its spectrum
# Of the study: ratios and, for each, records with noise of their own.
RATIOS_DB = (20.0, 15.0, 10.0, 5.0, 0.0, -5.0, -10.0)
SECONDS = 2.0
DRAWS = 4
NO_NOISE = "none"


@dataclass(frozen=True, kw_only=True, eq=False)
class NoiseSpectrum:
    """Power spectral density of a noise over frequency; `name` says where it is from. White without a density."""

    name: str
    frequency_hz: FloatArray | None = None
    density: FloatArray | None = None


def noise_spectrum(noise: str) -> NoiseSpectrum:
    """``white``, or the spectrum of the recording at that path.

    A recording's is its averaged spectrum (Welch) with all it contains: its machine's lines too, smeared. Above its
    Nyquist frequency it is zero. Raises what reading a recording raises.
    """
    if noise == WHITE:
        return NoiseSpectrum(name=WHITE)
    from scipy.signal import welch

    recording = load_registered(noise)
    name = recording.channel or (recording.axes or tuple(recording.channels))[-1]
    samples = recording.channels[name]
    frequency, density = welch(samples - samples.mean(), recording.fs_hz, nperseg=min(SEGMENT, samples.size))
    return NoiseSpectrum(
        name=f"{recording.name}, channel {name} ({recording.origin.value})", frequency_hz=frequency, density=density
    )


def add_noise(
    samples: FloatArray, fs_hz: float, *, snr_db: float, spectrum: NoiseSpectrum, random: np.random.Generator
) -> FloatArray:
    """`samples`, shape [n], with Gaussian noise of `spectrum`; `snr_db` is the ratio of the variances [dB].

    Raises `ConfigurationError` where the spectrum is zero at all frequencies of this sampling rate.
    """
    noise = random.standard_normal(samples.size)
    if spectrum.frequency_hz is not None and spectrum.density is not None:
        lines = np.fft.rfft(noise)
        frequency_hz = np.arange(lines.size) * fs_hz / samples.size
        gain = np.interp(frequency_hz, spectrum.frequency_hz, np.sqrt(spectrum.density), right=0.0)
        gain[0] = 0.0
        noise = np.fft.irfft(lines * gain, samples.size)
    power = float(np.var(noise))
    if power == 0:
        raise ConfigurationError(f"noise of {spectrum.name}: nothing is left of it at {fs_hz:g} Hz; take white noise.")
    scale = np.sqrt(np.var(samples) / power) * 10 ** (-snr_db / 20)
    return np.asarray(samples + scale * noise)


@dataclass(frozen=True, kw_only=True)
class NoiseRow:
    """One defect, noise spectrum and ratio: in how many `draws` the line was found, and its median height over noise.

    `deviation_pct` is the largest deviation of a found line from its frequency without added noise; None where none was
    found. `snr_db` is None without added noise.
    """

    state: str
    line: str
    colour: str
    snr_db: float | None
    draws: int
    found: int
    line_snr: float | None
    deviation_pct: float | None


def noise_study(
    *,
    noises: Sequence[str] = (WHITE,),
    ratios_db: Sequence[float] = RATIOS_DB,
    seconds: float = SECONDS,
    draws: int = DRAWS,
    progress: Progress = silent,
) -> list[NoiseRow]:
    """The paper's scene with each race defect, `seconds` long, under each of the `noises` (see `noise_spectrum`).

    Noise is added to both radial axes, each with the signal-to-noise ratio of `ratios_db` over all frequencies; a draw
    is reproducible by its number. Raises `NumericsError` where a run fails, and what reading a recording raises.
    """
    spectra = [noise_spectrum(noise) for noise in noises]
    rows: list[NoiseRow] = []
    total = len(RACE_DEFECTS) * len(spectra) * len(ratios_db)
    noisy_rows = 0
    for fault in RACE_DEFECTS:
        progress("detection under noise", noisy_rows / total)
        record = _record(fault, seconds)
        clean = _line(record, fault)
        rows.append(_row(fault, clean, [clean], NO_NOISE, None))
        for spectrum in spectra:
            for ratio in ratios_db:
                lines = [_line(noisy, fault) for noisy in _noisy_records(record, spectrum, ratio, draws)]
                rows.append(_row(fault, clean, lines, spectrum.name, ratio))
                noisy_rows += 1
                progress("detection under noise", noisy_rows / total)
    return rows


def _record(fault: Fault, seconds: float) -> Recording:
    run = simulate(paper_scene(defect={"kind": fault}, duration_s=seconds))
    if run.status is not RunStatus.OK:
        raise NumericsError(f"noise study: the {fault} run failed ({run.status}): {run.reason}")
    return recording_from_run(run)


def _line(record: Recording, fault: Fault) -> Line:
    return analyse(record, bearing=load_bearing(record.bearing or "")).line_of(fault)


def _noisy_records(record: Recording, spectrum: NoiseSpectrum, snr_db: float, draws: int) -> Iterator[Recording]:
    for draw in range(draws):
        random = np.random.default_rng([draw, round(1000 * (snr_db + 1000))])
        channels = {
            axis: add_noise(samples, record.fs_hz, snr_db=snr_db, spectrum=spectrum, random=random)
            for axis, samples in record.channels.items()
        }
        yield replace(record, channels=channels)


def _row(fault: Fault, clean: Line, lines: Sequence[Line], colour: str, snr_db: float | None) -> NoiseRow:
    found_hz = [line.found_hz for line in lines if line.detected and line.found_hz is not None]
    clean_hz = clean.found_hz
    return NoiseRow(
        state=fault.value,
        line=fault.line or "",
        colour=colour,
        snr_db=snr_db,
        draws=len(lines),
        found=len(found_hz),
        line_snr=median(line.snr or 0.0 for line in lines),
        deviation_pct=max((100 * abs(f / clean_hz - 1) for f in found_hz), default=None) if clean_hz else None,
    )
