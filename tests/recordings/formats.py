"""One synthetic record of two sensors in every format that has a loader, with the settings each format needs."""

import functools
import tempfile
from pathlib import Path

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault, load_bearing
from tests.recordings.synthetic_record import vibration

FS_HZ, SHAFT_HZ, SECONDS = 20480.0, 25.0, 1.0
COUNT = round(FS_HZ * SECONDS)
TIME = np.arange(COUNT) / FS_HZ
BEARING = load_bearing("skf-6205")
G = 9.80665
MV_PER_G = 100.0
FULL_SCALE_V = 1.0
SPELLED = "g:g m/s²:m/s2 m/s^2:m/s2 M/S^2:m/s2 m·s⁻²:m/s2 mg:mg G's:g g_pk:g in/s2:in/s2 Gal:gal mm/s:mm/s ips:ips "
SPELLED += "IN/SEC:ips inch/s:ips mm/s_RMS:mm/s µm:um µm_p-p:um mils:mil V:V Pa:Pa gE:gE °C:degC LSB:counts U/min:rpm "
SPELLED += "a: furlong/s2:"
# Units that texts in files mean; None for a text that is no unit.
MEANT = {text.replace("_", " "): unit or None for text, unit in (pair.split(":") for pair in SPELLED.split())}


@functools.cache
def record():
    """Samples [g] of two sensors: one without a fault, one with an outer-race fault."""
    other, sensor = (
        vibration(state, BEARING.orders, TIME * SHAFT_HZ, np.random.default_rng(i)) / G
        for i, state in enumerate((Fault.HEALTHY, Fault.OUTER))
    )
    return other, sensor


def write_csv(path, other, sensor):
    rows = (f"{t:.9f};{a:.8f};{b:.8f}".replace(".", ",") for t, a, b in zip(TIME, other, sensor, strict=True))
    lines = ["\ufeff// exported", "Zeit (s);acc NDE [g];acc DE [g]", *rows]
    path.write_text("\r\n".join(lines) + "\r\n", encoding="utf-8")


def write_sound(path, other, sensor, *, scale, **kind):
    pytest.importorskip("soundfile").write(path, np.stack([other, sensor], axis=1) * scale, round(FS_HZ), **kind)


def write_tdms(path, other, sensor):
    nptdms = pytest.importorskip("nptdms")
    properties = {"wf_increment": 1 / FS_HZ, "unit_string": "g"}
    with nptdms.TdmsWriter(path) as writer:
        for name, samples in (("acc NDE", other), ("acc DE", sensor)):
            writer.write_segment([nptdms.ChannelObject("vibration", name, samples, properties=properties)])


def write_uff(path, other, sensor):
    pyuff = pytest.importorskip("pyuff")
    common = {"binary": 0, "func_type": 1, "rsp_dir": 3, "ref_node": 1, "ref_dir": 0, "x": TIME, "num_pts": COUNT}
    common |= {"abscissa_spec_data_type": 17, "ordinate_spec_data_type": 12, "ordinate_axis_units_lab": "g"}
    common |= {"orddenom_spec_data_type": 0, "z_axis_spec_data_type": 0, "abscissa_spacing": 1}
    signals = {"acc NDE": other, "acc DE": sensor}
    sets = [pyuff.prepare_58(rsp_node=i, data=signals[name], id1=name, **common) for i, name in enumerate(signals, 1)]
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")


def write_columns(path, other, sensor, *, module, write):
    table = pytest.importorskip("pyarrow").table({"t [s]": TIME, "acc NDE [g]": other, "acc DE [g]": sensor})
    getattr(pytest.importorskip(module), write)(table, path)


def write_npy(path, other, sensor):
    with path.open("wb") as stream:
        np.save(stream, np.stack([other, sensor], axis=1))


def write_npz(path, other, sensor):
    arrays = {"acc NDE": other, "acc DE": sensor, "fs": np.array(FS_HZ), "unit": np.array("g")}
    with path.open("wb") as stream:
        np.savez_compressed(stream, **arrays, labels=np.array([None]))


def write_matlab(path, other, sensor):
    values = {"rec": {"acc_NDE": other, "acc_DE": sensor, "fs": FS_HZ, "unit": "g"}}
    savemat(path, values, appendmat=False, do_compression=True)


def write_hdf5(path, other, sensor):
    with h5py.File(path, "w") as file:
        for name, samples, unit in (("acc NDE", other, "g"), ("acc DE", sensor * G, "m s-2")):
            file[name] = samples
            file[name].attrs.update({"unit": unit, "sampling_rate": FS_HZ})


# 24 bits of a converter of +-5 V behind a sensor of 100 mV/g.
IN_VOLT = {"unit": "V", "scale": FULL_SCALE_V, "sensitivity_mv_per_g": MV_PER_G}
write_wav = functools.partial(write_sound, scale=1.0, subtype="FLOAT", format="WAV")
write_flac = functools.partial(write_sound, scale=MV_PER_G / 1e3 / FULL_SCALE_V, subtype="PCM_24", format="FLAC")
write_parquet = functools.partial(write_columns, module="pyarrow.parquet", write="write_table")
write_feather = functools.partial(write_columns, module="pyarrow.feather", write="write_feather")
WRITERS = {
    "csv": (write_csv, {}),
    "wav": (write_wav, {"channel": "data[2]", "unit": "g"}),
    "flac": (write_flac, {"channel": "data[2]", **IN_VOLT}),
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
def whole(kind):
    """Content of an intact file of a kind; skips the test if the library that writes this kind is missing."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "record.dat")
        WRITERS[kind][0](path, *record())
        return path.read_bytes()
