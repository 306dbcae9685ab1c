"""A labelled data set from a campaign: segments of its signals, with added noise, in one HDF5 file with a data card."""

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval import __version__
from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.campaign.folder import read_cases, result_path
from srbval.campaign.results import read_result
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.loaders import detect_format
from srbval.recordings.registry import load_registered
from srbval.storage.hdf5_files import CHECKED, new_hdf5

WHITE = "white"
SEGMENT = 2048  # samples per Welch segment: smears the recording's lines, keeps the shape of its spectrum
# Labels of a segment: unit, what they are, type. Without a defect height and extent are 0; without added noise the
# ratio is infinite.
LABELS: dict[str, tuple[str, str, type]] = {
    "state": ("1", "0 healthy, 1 outer race, 2 inner race, 3 roller", np.int32),
    "shaft_speed_hz": ("Hz", "mean shaft speed", float),
    "radial_n": ("N", "radial load", float),
    "axial_n": ("N", "axial load", float),
    "defect_height_m": ("m", "height of the defect, pit below zero", float),
    "defect_extent_m": ("m", "length along the rolling direction, 0 where it is counted in points", float),
    "snr_db": ("dB", "variance of the signal over that of the added noise", float),
    "case": ("1", "number of the case in the campaign's plan; split training and test by this", np.int32),
    "start_s": ("s", "start of the segment in the case's record", float),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class NoiseSpectrum:
    """Power spectral density of a noise over frequency, white without a density; `name` states its origin."""

    name: str
    frequency_hz: FloatArray | None = None
    density: FloatArray | None = None


def export_campaign(
    path: Path, file: Path, *, segment_s: float = 1.0, snr_db: Sequence[float] = (), noise: str = WHITE, seed: int = 0
) -> dict[str, Any]:
    """Write labelled segments of all good cases of the campaign in folder `path` to `file`, whole or not at all.

    Successive segments last `segment_s`; each comes without noise and with noise at every ratio of `snr_db` [dB].
    `noise` is ``white`` or a recording whose spectrum it takes. Returns the document of ``campaign export``: `segments`
    of `samples` each; `left_out` cases had no signal or failed.

    Segments follow each other without overlap, float32. The same campaign, options and seed give the same samples.
    Raises `DataError` if no case has a signal that long, if sampling rates differ, if a result is damaged, or if `file`
    cannot be written.
    """
    if noise != WHITE and not snr_db:
        raise ConfigurationError("a noise spectrum is given, but no ratio: add --snr-db, such as --snr-db 10 0.")
    table = read_cases(path)
    spectrum = noise_spectrum(noise)
    left_out, fs_hz, count = 0, None, 0
    with new_hdf5(file) as out:
        for case in table.cases:
            found = _signal(result_path(path, case.key))
            if found is None:
                left_out += 1
                continue
            samples, attributes = found
            rate = float(attributes["fs_hz"])
            if fs_hz not in (None, rate):
                raise DataError(f"{path}: cases differ in output_rate ({fs_hz:g} and {rate:g} Hz); export one.")
            fs_hz = rate
            segments, labels = _segments(
                samples, fs_hz, segment_s, snr_db, spectrum, seeds=(seed, int(case.key[:16], 16))
            )
            count += len(segments)
            _append(out, segments, labels | _case_labels(attributes) | {"case": case.index})
        if not count or fs_hz is None:
            raise DataError(
                f"{path}: no case holds {segment_s:g} s of signal ({left_out} hold none at all). "
                'Ask for outputs = ["acceleration"] in the campaign, or for shorter segments.'
            )
        length = out["segments"].shape[1]
        about = {"name": table.campaign.name, "title": table.campaign.title, "version": table.version}
        counts = {"cases": len(table.cases) - left_out, "segments": count, "fs_hz": fs_hz, "segment_s": segment_s}
        out.attrs.update({"srbval_kind": "data-set", "fs_hz": fs_hz, "campaign": table.campaign.name})
        out.attrs.update({"version": table.version, "data_card": _data_card(snr_db, seed, spectrum, about | counts)})
    return {"file": file, "segments": count, "samples": length, "fs_hz": fs_hz, "left_out": left_out}


def _signal(path: Path) -> tuple[FloatArray, dict[str, Any]] | None:
    """Vertical acceleration of a case and the attributes of its file; None if it has none, `DataError` if damaged."""
    try:
        if not os.path.lexists(path) or not read_result(path).ending.usable:
            return None
    except DataError as error:
        raise DataError(f"{error} Run the campaign again first.") from None
    raw = detect_format(path).load(path)
    samples = raw.array("acceleration_y_m_s2")
    return None if samples is None else (samples, dict(raw.attributes))


def _segments(
    samples: FloatArray,
    fs_hz: float,
    segment_s: float,
    snr_db: Sequence[float],
    spectrum: NoiseSpectrum,
    seeds: tuple[int, int],
) -> tuple[NDArray[np.float32], dict[str, Any]]:
    """Segments, shape [k, length], without noise and at each ratio, and the labels that differ between them, [k]."""
    length = max(1, round(segment_s * fs_hz))
    pieces = samples[: samples.size // length * length].reshape(-1, length)
    rows = []
    for number, piece in enumerate(pieces):
        rows.append(piece)
        for ratio in snr_db:
            # noise of its own for every segment and ratio, the same whatever else is exported
            random = np.random.default_rng([*seeds, number, round((ratio + 1000) * 1000)])
            rows.append(add_noise(piece, fs_hz, snr_db=ratio, spectrum=spectrum, random=random))
    ratios = [np.inf, *snr_db]
    labels = {
        "snr_db": np.tile(ratios, len(pieces)),
        "start_s": np.repeat(np.arange(len(pieces)) * length / fs_hz, len(ratios)),
    }
    return np.array(rows, dtype=np.float32).reshape(len(rows), length), labels


def _case_labels(attributes: dict[str, Any]) -> dict[str, float]:
    defect = json.loads(str(attributes["scene"]))["defect"]
    fault = Fault(defect["kind"])
    healthy = fault is Fault.HEALTHY
    return {
        "state": list(Fault).index(fault),
        **{name: float(attributes[name]) for name in ("shaft_speed_hz", "radial_n", "axial_n")},
        "defect_height_m": 0.0 if healthy else defect["height_m"],
        "defect_extent_m": 0.0 if healthy else (defect["extent_m"] or 0.0),
    }


def _append(out: Any, segments: NDArray[np.float32], labels: dict[str, Any]) -> None:
    if not len(segments):
        return
    columns: dict[str, Any] = {"segments": segments}
    columns |= {name: np.full(len(segments), labels[name], dtype=kind) for name, (_, _, kind) in LABELS.items()}
    for name, values in columns.items():
        if name in out:
            out[name].resize(len(out[name]) + len(values), axis=0)
            out[name][-len(values) :] = values
        else:
            made = out.create_dataset(name, data=values, maxshape=(None, *values.shape[1:]), **CHECKED)
            units, text, _ = LABELS.get(name, ("m s-2", "acceleration of the outer ring, one segment per row", float))
            made.attrs.update({"units": units, "long_name": text})


def _data_card(snr_db: Sequence[float], seed: int, spectrum: NoiseSpectrum, facts: dict[str, Any]) -> str:
    """The data card: origin and limits of the set, as Markdown (`data_card.md`)."""
    noise, origin = "none was added; `snr_db` is infinite throughout.", "the noise, if any, is synthetic too."
    of_recording = spectrum.frequency_hz is not None
    if snr_db:
        noise = (
            f"each segment comes without noise (`snr_db` infinite) and with {'coloured' if of_recording else 'white'} "
            f"Gaussian noise at {', '.join(f'{ratio:g}' for ratio in snr_db)} dB, seed {seed}. The "
            "ratio is that of the variances of the whole segment, over all frequencies."
        )
    if of_recording:
        origin = f"only the spectrum of the added noise was taken from {spectrum.name}."
    template = (resources.files("srbval.campaign") / "data_card.md").read_text(encoding="utf-8")
    facts |= {"title": facts["title"] or "no title", "program": __version__}
    return template.format(**facts, noise=noise, noise_origin=origin)


def noise_spectrum(noise: str) -> NoiseSpectrum:
    """``white``, or the spectrum of the recording at that path.

    A recording's is its averaged spectrum (Welch) with all it contains: its machine's lines too, smeared. Above its
    Nyquist frequency it is zero. Raises what reading a recording raises.
    """
    if noise == WHITE:
        return NoiseSpectrum(name=WHITE)
    from srbval.signal import power_density

    recording = load_registered(noise)
    name = recording.channel or (recording.axes or tuple(recording.channels))[-1]
    samples = recording.channels[name]
    frequency, density = power_density(samples - samples.mean(), recording.fs_hz, SEGMENT / recording.fs_hz)
    return NoiseSpectrum(
        name=f"{recording.name}, channel {name} ({recording.origin.value})", frequency_hz=frequency, density=density
    )


def add_noise(
    samples: FloatArray, fs_hz: float, *, snr_db: float, spectrum: NoiseSpectrum, random: np.random.Generator
) -> FloatArray:
    """`samples`, shape [n], with Gaussian noise of `spectrum`; `snr_db` is the ratio of the variances [dB].

    Raises `ConfigurationError` if the spectrum is zero at all frequencies of this sampling rate.
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
        raise ConfigurationError(f"noise of {spectrum.name}: nothing is left of it at {fs_hz:g} Hz; use white noise.")
    scale = np.sqrt(np.var(samples) / power) * 10 ** (-snr_db / 20)
    return np.asarray(samples + scale * noise)
