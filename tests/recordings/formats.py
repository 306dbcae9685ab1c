"""One synthetic record, two sensors, in every format that has a loader, and what the user must state of it."""

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault, load_bearing
from tests.recordings.synthetic_record import vibration

FS_HZ, SHAFT_HZ, SECONDS = 20480.0, 25.0, 1.0
COUNT = round(FS_HZ * SECONDS)
BEARING = load_bearing("skf-6205")
G = 9.80665
MV_PER_G = 100.0
FULL_SCALE_V = 1.0
Writer = Callable[[Path, np.ndarray, np.ndarray], None]


@functools.cache
def record() -> tuple[np.ndarray, np.ndarray]:
    """Two channels [g]: a sensor without and one with an outer-race fault."""
    turns = np.arange(COUNT) * SHAFT_HZ / FS_HZ
    other, sensor = (
        vibration(state, BEARING.orders, turns, np.random.default_rng(i)) / G
        for i, state in enumerate((Fault.HEALTHY, Fault.OUTER))
    )
    return other, sensor


def write_csv(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    rows = zip(np.arange(COUNT) / FS_HZ, other, sensor, strict=True)
    lines = [
        "\ufeff// exported",
        "Zeit (s);acc NDE [g];acc DE [g]",
        *(f"{t:.9f};{a:.8f};{b:.8f}".replace(".", ",") for t, a, b in rows),
    ]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")


def write_tab(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    """Names and units in lines of their own, m/s² in a signal's column."""
    rows = zip(np.arange(COUNT) / FS_HZ * 1e3, other, sensor * G, strict=True)
    lines = ["% exported", "time\tacc NDE\tacc DE", "ms\tg\tm/s²", *(f"{t:.7f}\t{a:.8f}\t{b:.8f}" for t, a, b in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="latin-1")


def write_wav(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    soundfile = pytest.importorskip("soundfile")
    soundfile.write(path, np.stack([other, sensor], axis=1), round(FS_HZ), subtype="FLOAT", format="WAV")


def write_flac(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    """24 bits of a converter of +-5 V behind a sensor of 100 mV/g."""
    soundfile = pytest.importorskip("soundfile")
    volts = np.stack([other, sensor], axis=1) * MV_PER_G / 1e3
    soundfile.write(path, volts / FULL_SCALE_V, round(FS_HZ), subtype="PCM_24", format="FLAC")


def write_tdms(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": 1 / FS_HZ, "unit_string": "g"}
    with nptdms.TdmsWriter(path) as writer:
        for name, samples in (("acc NDE", other), ("acc DE", sensor)):
            writer.write_segment([nptdms.ChannelObject("vibration", name, samples, properties=properties)])


def write_uff(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    pyuff = pytest.importorskip("pyuff")
    sets = [
        pyuff.prepare_58(
            binary=0,
            func_type=1,
            rsp_node=node,
            rsp_dir=3,
            ref_node=1,
            ref_dir=0,
            data=samples,
            id1=name,
            x=np.arange(COUNT) / FS_HZ,
            num_pts=COUNT,
            abscissa_spec_data_type=17,
            ordinate_spec_data_type=12,
            ordinate_axis_units_lab="g",
            orddenom_spec_data_type=0,
            z_axis_spec_data_type=0,
            abscissa_spacing=1,
        )
        for node, (name, samples) in enumerate((("acc NDE", other), ("acc DE", sensor)), 1)
    ]
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def table(other: np.ndarray, sensor: np.ndarray) -> Any:
    pyarrow = pytest.importorskip("pyarrow")
    return pyarrow.table({"t [s]": np.arange(COUNT) / FS_HZ, "acc NDE [g]": other, "acc DE [g]": sensor})


def write_parquet(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    pytest.importorskip("pyarrow.parquet").write_table(table(other, sensor), path)


def write_feather(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    pytest.importorskip("pyarrow.feather").write_feather(table(other, sensor), path)


def write_npy(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    with path.open("wb") as stream:
        np.save(stream, np.stack([other, sensor], axis=1))


def write_npz(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    arrays = {"acc NDE": other, "acc DE": sensor, "fs": np.array(FS_HZ), "unit": np.array("g")}
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays, labels=np.array([None]))


def write_matlab(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    values = {"rec": {"acc_NDE": other, "acc_DE": sensor, "fs": FS_HZ, "unit": "g"}}
    savemat(path, values, appendmat=False, do_compression=True)


def write_hdf5(path: Path, other: np.ndarray, sensor: np.ndarray) -> None:
    with h5py.File(path, "w") as file:
        for name, samples in (("acc NDE", other), ("acc DE", sensor * G)):
            file[name] = samples
            file[name].attrs.update({"unit": "g" if name == "acc NDE" else "m s-2", "sampling_rate": FS_HZ})


WRITERS: dict[str, tuple[Writer, dict[str, Any]]] = {
    "csv": (write_csv, {}),
    "tab": (write_tab, {}),
    "wav": (write_wav, {"channel": "data[2]", "unit": "g"}),
    "flac": (write_flac, {"channel": "data[2]", "unit": "V", "scale": FULL_SCALE_V, "sensitivity_mv_per_g": MV_PER_G}),
    "tdms": (write_tdms, {}),
    "uff": (write_uff, {}),
    "parquet": (write_parquet, {}),
    "feather": (write_feather, {}),
    "npy": (write_npy, {"channel": "data[2]", "unit": "g", "fs_hz": FS_HZ}),
    "npz": (write_npz, {}),
    "matlab": (write_matlab, {"channel": "rec.acc_DE"}),
    "hdf5": (write_hdf5, {}),
}


@functools.cache
def whole(kind: str) -> bytes:
    """The file of a kind; skips visibly where the library that writes it is missing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "record.dat")
        WRITERS[kind][0](path, *record())
        return path.read_bytes()
