"""A labelled data set from a campaign: segments of its signals, with added noise, in one HDF5 file with a data card."""

import json
import os
from collections.abc import Iterator, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval import __version__
from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.campaign.results import read_result
from srbval.campaign.run import read_table, result_path
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.registry import load_registered
from srbval.signal import power_density, with_noise
from srbval.storage.hdf5_files import CHECKED, new_hdf5

WHITE = "white"
SEGMENT = 2048  # samples per Welch segment: smears the recording's lines, keeps the shape of its spectrum
# Columns of the set: unit, what they are, type. Without a defect height and extent are 0; without added noise the ratio
# is infinite.
COLUMNS: dict[str, tuple[str, str, type]] = {
    "segments": ("m s-2", "acceleration of the outer ring, one segment per row", np.float32),
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
Density = tuple[FloatArray, FloatArray]  # frequencies [Hz] and power of a noise


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
    table, (origin, density) = read_table(path), _noise(noise)
    left_out, fs_hz, length = 0, None, 0
    with new_hdf5(file) as out:
        for case in table.cases:
            found = _signal(result_path(path, case.key))
            if found is None:
                left_out += 1
                continue
            samples, labels = found
            rate = labels.pop("fs_hz")
            if fs_hz not in (None, rate):
                raise DataError(f"{path}: cases differ in output_rate ({fs_hz:g} and {rate:g} Hz); export one.")
            fs_hz, length, random = rate, max(1, round(segment_s * rate)), (seed, int(case.key[:16], 16))
            segments = _segments(samples, fs_hz, length, snr_db, density, random)
            if rows := [labels | {"case": case.index} | segment for segment in segments]:
                _append(out, rows)
        if fs_hz is None or "segments" not in out:
            raise DataError(
                f"{path}: no case holds {segment_s:g} s of signal ({left_out} hold none at all). "
                'Ask for outputs = ["acceleration"] in the campaign, or for shorter segments.'
            )
        made = {"segments": len(out["segments"]), "samples": length, "fs_hz": fs_hz, "left_out": left_out}
        about: dict[str, Any] = {
            "name": table.campaign.name,
            "title": table.campaign.title or "no title",
            "version": table.version,
        }
        about |= {"cases": len(table.cases) - left_out, "segment_s": segment_s, "program": __version__}
        out.attrs.update({"srbval_kind": "data-set", "fs_hz": fs_hz, "campaign": table.campaign.name})
        ratios = ", ".join(f"{ratio:g}" for ratio in snr_db)
        about["noise"] = f"Gaussian, {origin}, at {ratios} dB, seed {seed}" if snr_db else "none"
        card = (resources.files("srbval.campaign") / "data_card.md").read_text(encoding="utf-8")
        out.attrs.update({"version": table.version, "data_card": card.format(**about | made)})
    return {"file": file} | made


def _signal(path: Path) -> tuple[FloatArray, dict[str, Any]] | None:
    """Vertical acceleration of a case, its labels and `fs_hz`; None if it has none, `DataError` if damaged."""
    import h5py

    try:
        if not os.path.lexists(path) or not read_result(path).usable:
            return None
    except DataError as error:
        raise DataError(f"{error} Run the campaign again first.") from None
    with h5py.File(path) as file:
        if "acceleration_y_m_s2" not in file:
            return None
        samples, scene = file["acceleration_y_m_s2"][:], json.loads(file.attrs["scene"])
        labels = {name: float(file.attrs[name]) for name in ("fs_hz", "shaft_speed_hz", "radial_n", "axial_n")}
    defect, fault = scene["defect"], Fault(scene["defect"]["kind"])
    size = (0.0, 0.0) if fault is Fault.HEALTHY else (defect["height_m"], defect["extent_m"] or 0.0)
    return samples, labels | {
        "state": list(Fault).index(fault),
        "defect_height_m": size[0],
        "defect_extent_m": size[1],
    }


def _segments(
    samples: FloatArray,
    fs_hz: float,
    length: int,
    snr_db: Sequence[float],
    density: Density | None,
    seeds: tuple[int, int],
) -> Iterator[dict[str, Any]]:
    """Segments without noise and at each ratio, and the labels that differ between them."""
    for number, piece in enumerate(samples[: samples.size // length * length].reshape(-1, length)):
        start_s = number * length / fs_hz
        yield {"segments": piece, "snr_db": np.inf, "start_s": start_s}
        for ratio in snr_db:
            # noise of its own for every segment and ratio, the same whatever else is exported
            random = np.random.default_rng([*seeds, number, round((ratio + 1000) * 1000)])
            noisy = with_noise(piece, fs_hz, snr_db=ratio, random=random, density=density)
            yield {"segments": noisy, "snr_db": ratio, "start_s": start_s}


def _append(out: Any, rows: Sequence[dict[str, Any]]) -> None:
    """Append rows to the columns of the set, which the first ones make."""
    for name, (units, text, kind) in COLUMNS.items():
        values: NDArray[Any] = np.array([row[name] for row in rows], dtype=kind)
        if name in out:
            out[name].resize(len(out[name]) + len(values), axis=0)
            out[name][-len(values) :] = values
        else:
            made = out.create_dataset(name, data=values, maxshape=(None, *values.shape[1:]), **CHECKED)
            made.attrs.update({"units": units, "long_name": text})


def _noise(noise: str) -> tuple[str, Density | None]:
    """Description and density of a noise: ``white``, without one, or that of the recording at that path.

    It is the averaged spectrum (Welch) of all that the recording contains: its machine's lines too, smeared. Above the
    recording's Nyquist frequency it is zero. Raises what reading a recording raises.
    """
    if noise == WHITE:
        return noise, None
    recording = load_registered(noise)
    name = recording.channel or (recording.axes or tuple(recording.channels))[-1]
    samples = recording.channels[name]
    density = power_density(samples - samples.mean(), recording.fs_hz, SEGMENT / recording.fs_hz)
    return f"with the spectrum of {recording.name}, channel {name} ({recording.origin.value})", density
