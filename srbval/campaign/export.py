"""A labelled data set from a campaign: segments of its signals in one HDF5, with a data card."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.campaign.case import Case
from srbval.campaign.data_card import data_card
from srbval.campaign.export_settings import ExportSettings
from srbval.campaign.noise import Colour, add_noise, colour_of
from srbval.campaign.store import Store
from srbval.errors import DataError
from srbval.storage.own_hdf5 import SCHEMA_VERSION
from srbval.storage.whole_file import whole_file

FloatArray = NDArray[np.float64]

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
class Exported:
    """What was written: `segments` of `samples` each; `left_out` cases had no signal or failed."""

    file: Path
    segments: int
    samples: int
    fs_hz: float
    left_out: int

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def export_campaign(folder: Path, file: Path, settings: ExportSettings) -> Exported:
    """Write labelled segments of all good cases of the campaign in `folder` to `file`, whole or not at all.

    Segments follow each other without overlap, float32. The same campaign, settings and seed give the same samples.
    Raises `DataError` where no case holds a signal that long, where rates differ, or `file` cannot be written.
    """
    import h5py

    store = Store(folder)
    about, cases = store.about(), store.planned()
    colour = colour_of(settings.noise)
    left_out, fs_hz, count = 0, None, 0
    try:
        with whole_file(file) as part, h5py.File(part, "w", track_order=True) as out:
            for case in cases:
                found = _signal(store, case, settings.axis)
                if found is None:
                    left_out += 1
                    continue
                samples, attributes = found
                rate = float(attributes["fs_hz"])
                if fs_hz not in (None, rate):
                    raise DataError(f"{folder}: cases differ in output_rate ({fs_hz:g} and {rate:g} Hz); export one.")
                fs_hz = rate
                segments, labels = _segments(case, samples, attributes, settings, colour)
                count += len(segments)
                _append(out, segments, labels)
            if not count or fs_hz is None:
                raise DataError(
                    f"{folder}: no case holds {settings.segment_s:g} s of signal ({left_out} hold none at all). "
                    'Ask for outputs = ["acceleration"] in the campaign, or for shorter segments.'
                )
            length = out["segments"].shape[1]
            card = data_card(about, settings, colour, cases=len(cases) - left_out, segments=count, fs_hz=fs_hz)
            out.attrs.update({"schema_version": SCHEMA_VERSION, "srbval_kind": "data-set", "fs_hz": fs_hz})
            out.attrs.update({"campaign": about["name"], "version": about["version"], "data_card": card})
    except OSError as error:
        raise DataError(f"{file}: cannot be written ({error.strerror or error}).") from None
    return Exported(file=file, segments=count, samples=length, fs_hz=fs_hz, left_out=left_out)


def _signal(store: Store, case: Case, axis: str) -> tuple[FloatArray, dict[str, Any]] | None:
    """A case's acceleration and its file's attributes; None where it has none."""
    import h5py

    try:
        with h5py.File(store.path_of(case.key), "r") as file:
            name = f"acceleration_{axis}_m_s2"
            return (file[name][()], dict(file.attrs)) if name in file else None
    except OSError:
        return None


def _segments(
    case: Case, samples: FloatArray, attributes: dict[str, Any], settings: ExportSettings, colour: Colour
) -> tuple[NDArray[np.float32], dict[str, FloatArray]]:
    """Segments, shape [k, length], without noise and at each ratio, and their labels, [k] each."""
    fs_hz = float(attributes["fs_hz"])
    length = max(1, round(settings.segment_s * fs_hz))
    pieces = samples[: samples.size // length * length].reshape(-1, length)
    label = _label(attributes, case.index)
    rows, ratios, starts = [], [], []
    for number, piece in enumerate(pieces):
        for snr_db in (np.inf, *settings.snr_db):
            rows.append(piece if np.isinf(snr_db) else _noisy(piece, fs_hz, snr_db, colour, settings, case, number))
            ratios.append(snr_db)
            starts.append(number * length / fs_hz)
    table = {name: np.full(len(rows), value) for name, value in label.items()}
    table |= {"snr_db": np.array(ratios), "start_s": np.array(starts)}
    return np.array(rows, dtype=np.float32).reshape(len(rows), length), table


def _noisy(
    piece: FloatArray, fs_hz: float, snr_db: float, colour: Colour, settings: ExportSettings, case: Case, number: int
) -> FloatArray:
    """Noise of its own for every segment and ratio, the same whatever else is exported."""
    seeds = [settings.seed, int(case.key[:16], 16), number, round((snr_db + 1000) * 1000)]
    return add_noise(piece, fs_hz, snr_db=snr_db, colour=colour, random=np.random.default_rng(seeds))


def _label(attributes: dict[str, Any], index: int) -> dict[str, float]:
    import json

    scene = json.loads(str(attributes["scene"]))
    defect = scene["defect"]
    fault = Fault(defect["kind"])
    there = fault is not Fault.HEALTHY
    return {
        "state": float(list(Fault).index(fault)),
        "shaft_speed_hz": float(attributes["shaft_speed_hz"]),
        "radial_n": float(attributes["radial_n"]),
        "axial_n": float(attributes["axial_n"]),
        "defect_height_m": defect["height_m"] if there else 0.0,
        "defect_extent_m": (defect["extent_m"] or 0.0) if there else 0.0,
        "case": float(index),
    }


def _append(out: Any, segments: NDArray[np.float32], labels: dict[str, FloatArray]) -> None:
    for name, values in _columns(segments, labels):
        if name not in out:
            made = out.create_dataset(name, data=values, maxshape=(None, *values.shape[1:]), chunks=True)
            units, text = LABELS.get(name, ("m s-2", "acceleration of the outer ring, one segment a row"))
            made.attrs.update({"units": units, "long_name": text})
        else:
            out[name].resize(len(out[name]) + len(values), axis=0)
            out[name][-len(values) :] = values


def _columns(segments: NDArray[np.float32], labels: dict[str, FloatArray]) -> Iterator[tuple[str, NDArray[Any]]]:
    if len(segments):
        yield "segments", segments
        for name in LABELS:
            yield name, labels[name].astype(np.int32) if name in ("state", "case") else labels[name]
