"""A labelled data set from a campaign: segments of its signals in one HDF5 file, with a data card."""

import json
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval import __version__
from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.campaign.campaign_folder import About, CampaignFolder, Damaged
from srbval.campaign.case import CampaignCase
from srbval.campaign.noise import WHITE, NoiseSpectrum, add_noise, noise_spectrum
from srbval.campaign.results import result_state
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.loaders import detect_format
from srbval.storage.hdf5_files import CHECKED, new_hdf5

# Labels of a segment: unit and what they are. Without a defect, height is 0 and so is extent; without added noise the
# ratio is infinite.
LABELS = {
    "state": ("1", "0 healthy, 1 outer race, 2 inner race, 3 roller"),
    "shaft_speed_hz": ("Hz", "mean shaft speed"),
    "radial_n": ("N", "radial load"),
    "axial_n": ("N", "axial load"),
    "defect_height_m": ("m", "height of the defect, pit below zero"),
    "defect_extent_m": ("m", "length along the rolling direction, 0 where it is counted in points"),
    "snr_db": ("dB", "variance of the signal over that of the added noise"),
    "case": ("1", "number of the case in the campaign's plan; split training and test by this"),
    "start_s": ("s", "start of the segment in the case's record"),
}


@dataclass(frozen=True, kw_only=True)
class ExportSettings:
    """Successive segments of `segment_s`, each without noise and with noise at every ratio of `snr_db`.

    `noise` is ``white`` or a recording whose spectrum it takes; `axis` that of the acceleration.
    """

    segment_s: float = 1.0
    snr_db: tuple[float, ...] = ()
    noise: str = WHITE
    axis: str = "y"
    seed: int = 0

    def __post_init__(self) -> None:
        if self.axis not in ("x", "y", "z"):
            raise ConfigurationError(f"axis {self.axis!r} must be x, y or z.")
        if self.noise != WHITE and not self.snr_db:
            raise ConfigurationError("a noise spectrum is given, but no ratio: add --snr-db, such as --snr-db 10 0.")


@dataclass(frozen=True, kw_only=True)
class ExportedSet:
    """What was written: `segments` of `samples` each; `left_out` cases had no signal or failed."""

    file: Path
    segments: int
    samples: int
    fs_hz: float
    left_out: int


def export_campaign(path: Path, file: Path, settings: ExportSettings) -> ExportedSet:
    """Write labelled segments of all good cases of the campaign in folder `path` to `file`, whole or not at all.

    Segments follow each other without overlap, float32. The same campaign, settings and seed give the same samples.
    Raises `DataError` where no case holds a signal that long, where rates differ, or `file` cannot be written.
    """
    folder = CampaignFolder(path)
    about, cases = folder.about(), folder.planned()
    spectrum = noise_spectrum(settings.noise)
    left_out, fs_hz, count = 0, None, 0
    try:
        with new_hdf5(file) as out:
            for case in cases:
                found = _signal(folder, case, settings.axis)
                if found is None:
                    left_out += 1
                    continue
                samples, attributes = found
                rate = float(attributes["fs_hz"])
                if fs_hz not in (None, rate):
                    raise DataError(f"{path}: cases differ in output_rate ({fs_hz:g} and {rate:g} Hz); export one.")
                fs_hz = rate
                segments, labels = _segments(case, samples, attributes, settings, spectrum)
                count += len(segments)
                _append(out, segments, labels)
            if not count or fs_hz is None:
                raise DataError(
                    f"{path}: no case holds {settings.segment_s:g} s of signal ({left_out} hold none at all). "
                    'Ask for outputs = ["acceleration"] in the campaign, or for shorter segments.'
                )
            length = out["segments"].shape[1]
            card = _data_card(about, settings, spectrum, cases=len(cases) - left_out, segments=count, fs_hz=fs_hz)
            out.attrs.update({"srbval_kind": "data-set", "fs_hz": fs_hz})
            out.attrs.update({"campaign": about.name, "version": about.version, "data_card": card})
    except OSError as error:
        raise DataError(f"{file}: cannot be written ({error.strerror or error}).") from None
    return ExportedSet(file=file, segments=count, samples=length, fs_hz=fs_hz, left_out=left_out)


def _signal(folder: CampaignFolder, case: CampaignCase, axis: str) -> tuple[FloatArray, dict[str, Any]] | None:
    """A case's acceleration and its file's attributes; None where it has none, `DataError` where it is damaged."""
    path = folder.result_path(case.key)
    state = result_state(path)
    if isinstance(state, Damaged):
        raise DataError(f"{path}: {state.why} Run the campaign again first.")
    if state is None or not state.ending.usable:
        return None
    raw = detect_format(path).load(path)
    samples = raw.array(f"acceleration_{axis}_m_s2")
    return None if samples is None else (samples, dict(raw.attributes))


def _segments(
    case: CampaignCase,
    samples: FloatArray,
    attributes: dict[str, Any],
    settings: ExportSettings,
    spectrum: NoiseSpectrum,
) -> tuple[NDArray[np.float32], dict[str, FloatArray]]:
    """Segments, shape [k, length], without noise and at each ratio, and their labels, [k] each."""
    fs_hz = float(attributes["fs_hz"])
    length = max(1, round(settings.segment_s * fs_hz))
    pieces = samples[: samples.size // length * length].reshape(-1, length)
    rows, ratios, starts = [], [], []
    for number, piece in enumerate(pieces):
        rows.append(piece)
        for snr_db in settings.snr_db:
            # noise of its own for every segment and ratio, the same whatever else is exported
            seeds = [settings.seed, int(case.key[:16], 16), number, round((snr_db + 1000) * 1000)]
            random = np.random.default_rng(seeds)
            rows.append(add_noise(piece, fs_hz, snr_db=snr_db, spectrum=spectrum, random=random))
        ratios += [np.inf, *settings.snr_db]
        starts += [number * length / fs_hz] * (1 + len(settings.snr_db))
    table = {name: np.full(len(rows), value) for name, value in _case_labels(attributes, case.index).items()}
    table |= {"snr_db": np.array(ratios), "start_s": np.array(starts)}
    return np.array(rows, dtype=np.float32).reshape(len(rows), length), table


def _case_labels(attributes: dict[str, Any], index: int) -> dict[str, float]:
    defect = json.loads(str(attributes["scene"]))["defect"]
    fault = Fault(defect["kind"])
    healthy = fault is Fault.HEALTHY
    return {
        "state": float(list(Fault).index(fault)),
        "shaft_speed_hz": float(attributes["shaft_speed_hz"]),
        "radial_n": float(attributes["radial_n"]),
        "axial_n": float(attributes["axial_n"]),
        "defect_height_m": 0.0 if healthy else defect["height_m"],
        "defect_extent_m": 0.0 if healthy else (defect["extent_m"] or 0.0),
        "case": float(index),
    }


def _append(out: Any, segments: NDArray[np.float32], labels: dict[str, FloatArray]) -> None:
    if not len(segments):
        return
    whole_numbers = {name: labels[name].astype(np.int32) for name in ("state", "case")}
    columns = {"segments": segments} | {name: labels[name] for name in LABELS} | whole_numbers
    for name, values in columns.items():
        if name in out:
            out[name].resize(len(out[name]) + len(values), axis=0)
            out[name][-len(values) :] = values
        else:
            made = out.create_dataset(name, data=values, maxshape=(None, *values.shape[1:]), **CHECKED)
            units, text = LABELS.get(name, ("m s-2", "acceleration of the outer ring, one segment per row"))
            made.attrs.update({"units": units, "long_name": text})


def _data_card(
    about: About, settings: ExportSettings, spectrum: NoiseSpectrum, *, cases: int, segments: int, fs_hz: float
) -> str:
    """How the set was made and what it is not good for, as Markdown (`data_card.md`)."""
    ratios = ", ".join(f"{ratio:g}" for ratio in settings.snr_db)
    of_recording = spectrum.frequency_hz is not None
    noise = (
        f"each segment comes without noise (`snr_db` infinite) and with {'coloured' if of_recording else 'white'} "
        f"Gaussian noise at {ratios} dB, seed {settings.seed}. The ratio is that of the variances of the whole "
        "segment, over all frequencies."
        if ratios
        else "none was added; `snr_db` is infinite throughout."
    )
    noise_origin = (
        f"only the spectrum of the added noise was taken from {spectrum.name}."
        if of_recording
        else "the noise, if any, is synthetic too."
    )
    template = (resources.files("srbval.campaign") / "data_card.md").read_text(encoding="utf-8")
    return template.format(
        name=about.name,
        title=about.title or "no title",
        version=about.version,
        program=__version__,
        cases=cases,
        axis=settings.axis,
        fs_hz=fs_hz,
        segments=segments,
        segment_s=settings.segment_s,
        noise=noise,
        noise_origin=noise_origin,
    )
