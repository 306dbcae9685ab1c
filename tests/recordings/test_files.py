"""One record in every format, files in the layouts of known data sets, and runs written by srbval."""

import re
import shlex
import sys
from functools import partial, reduce

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault, known_bearings
from srbval.errors import DataError
from srbval.recordings import Origin, SpeedSource, load_recording, loaders
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.loaders import detect_format

from . import files
from .formats import FS_HZ, SHAFT_HZ, WRITERS, G, record, whole

DIGITS = 2e-6  # relative, of the largest sample: seven digits, or 24 bits
STEP_DIGITS = 1e-5  # relative: six digits of a time step


@pytest.mark.parametrize("kind", WRITERS)
def test_the_same_samples_from_every_format(kind, tmp_path):
    path = tmp_path / "record.dat"  # its name says nothing
    path.write_bytes(whole(kind))
    recording = load_recording(path, **{"channel": "acc DE", "rpm": SHAFT_HZ * 60, **WRITERS[kind][1]})
    assert (recording.unit, recording.speed.value_hz) == ("m/s2", SHAFT_HZ)
    assert recording.fs_hz == pytest.approx(FS_HZ, rel=STEP_DIGITS)
    samples = recording.channels[recording.channel]
    np.testing.assert_allclose(samples, record()[1] * G, atol=DIGITS * G * np.abs(record()[1]).max())


@pytest.mark.parametrize("kind", ["wav", "parquet"])
def test_a_library_that_is_missing_is_named(kind, tmp_path, monkeypatch):
    path = tmp_path / "x.dat"
    path.write_bytes(whole(kind))
    loaders.end_readers()
    (tmp_path / "broken").mkdir()
    module, name = detect_format(path).library or ("", "")
    (tmp_path / "broken" / f"{module.split('.')[0]}.py").write_text("raise ImportError('none here')")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path / "broken"))
    command = f"{shlex.quote(sys.executable)} -m pip install {name}"
    with pytest.raises(DataError, match=rf"reading it needs {name}\. Install: {re.escape(command)}$"):
        load_recording(path)
    loaders.end_readers()


def run_file(path, **attributes):
    with h5py.File(path, "w") as file:
        file.attrs.update({"srbval_kind": "run", "fs_hz": 61440.0, "facts": FACTS % "outer"} | attributes)
        for i, axis in enumerate("xyz"):
            file[f"acceleration_{axis}_m_s2"] = files.vibration(seed=i)
        file["cage_speed_rad_s"] = files.vibration(seed=9)
    return path


FACTS = '{"name": "a run", "origin": "simulated", "fs_hz": 61440.0, "unit": "m/s2", "axes": ["x", "y"], "state": "%s"}'
BAD_FACTS = ("[" * 50_000, '{"radial_n": 1' + "0" * 5000 + "}", "[]", '{"speed": [[]]}', FACTS.replace("y", "w"), "")


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"srbval_kind": "other"}, "srbval_kind is 'other'"),
        ({"facts": FACTS % "rusty"}, "'rusty' is not known"),
        ({"status": "cage-lost", "reason": "the cage stopped"}, r"run failed \(cage-lost: the cage stopped\)"),
        *(({"facts": facts}, r"facts about the run cannot be read .*simulate it again") for facts in BAD_FACTS),
    ],
)
def test_run_that_cannot_be_read(tmp_path, attributes, message):
    with pytest.raises(DataError, match=message):
        load_recording(run_file(tmp_path / "run.h5", **attributes))


BAND_EDGE = 0.01  # upper band edges are stated as round numbers
ROUNDING = 1e-15  # one multiplication by a factor that is not exactly representable
UNIT_ROUNDING = 1e-12  # two factors applied one after the other
MEAN_ROUNDING = 1e-9  # a mean over the samples in another order, or of rad/s in place of rpm
FULL_NAME = "IR_727rpm_124.8kN_49kN.mat"
KEYS = {  # of the tables that are read as mappings
    "bands": {"low_hz", "high_hz", "reason", "fs_hz"},
    "records": {"first", "last", "label", "fs_hz", "end", "note"},
    "files": {"name", "sha256", "url", "used_for"},
}
FACT_NAMES = {"label", "fs_hz", "mean_rpm", "rpm", "nominal_hz", "radial_kn", "radial_lbf", "axial_kn"}
GRID = {"source", "states", "radial_kn", "axial_kn", "nominal_rpm"}


@pytest.mark.parametrize("d", known_datasets(), ids=lambda d: d.name)
def test_names_patterns_addresses_and_bands_are_usable(d):
    """All open sets have the same band, 500 Hz to 10 kHz or 0.46 of the sampling rate; no band is fitted to a set."""
    assert {c.bearing for c in d.channels} - {None} <= set(known_bearings())
    for pattern in (d.match.file, *d.match.variables, *(c.variable for c in d.channels)):
        re.compile(pattern or "")
    assert d.url.startswith("https://")
    assert all(set(row) <= keys for table, keys in KEYS.items() for row in getattr(d, table))
    assert set(d.grid or GRID) == GRID
    assert {*d.constants, *d.fact_variables} <= FACT_NAMES
    assert all(re.fullmatch("[0-9a-f]{64}", f["sha256"]) for f in d.files if "sha256" in f)
    assert all(b["low_hz"] < b["high_hz"] and b["reason"] for b in d.bands)
    for band in () if d.name.startswith("torino") else d.bands:
        high_hz = min(10000.0, 0.46 * (band.get("fs_hz") or d.constants.get("fs_hz", 1e6)))
        assert (band["low_hz"], band["high_hz"]) == (500.0, pytest.approx(high_hz, rel=BAND_EDGE))


def upm_citef(path):
    savemat(path, {"Fs": 40000.0, **{f"Rod_{i}": 1.9 + 0.1 * files.vibration(seed=i)[:, None] for i in (3, 2, 1)}})
    return path


def rig(path, write=files.rig_v5):
    """Write a file in the rig's full layout with its signals in another order; their quantities identify them."""
    first, second, third = files.rig_signals(speed_rpm=700.0).values()
    return write(path, {"Signal_1": third, "Signal_7": first, "Signal_2": second})


def cwru(number, rpm=1796):
    return partial(files.cwru, number=number, rpm=rpm)


STATED, NOMINAL, TACHOMETER = SpeedSource.STATED, SpeedSource.NOMINAL, SpeedSource.TACHOMETER
EXCERPT_RPM = np.mean(858.0 + 0.5 * files.vibration(128, 1))
FULL_RPM = np.mean(700.0 + 0.3 * files.vibration(20, 9))
CWRU = {"dataset": "cwru", "unit": "m/s2", "fs_hz": 12000.0, "band_hz": (500.0, 5500.0), "nominal_rpm": 1797.0}
DE, FE = {"channel": "DE", "bearing": "skf-6205"}, {"channel": "FE", "bearing": "skf-6203"}
LOADED = {"nominal_rpm": 1772.0}
FAST = {"fs_hz": 48000.0, "band_hz": (500.0, 10000.0)}
MFPT = {"dataset": "mfpt", "state": Fault.OUTER, "bearing": "mfpt-nice", "fs_hz": 48828.0, "unit": "m/s2"}
MFPT |= {"radial_n": pytest.approx(25 * 4.4482216)}
UPM = {"dataset": "upm-citef", "channel": "Rod_1", "bearing": "fag-22205", "unit": "V", "fs_hz": 40000.0}
UPM |= {"band_hz": (500.0, 10000.0), "nominal_rpm": 200.0}
EXCERPT = {"dataset": "torino-excerpts", "channel": "sensor_4", "unit": "m/s2", "fs_hz": 20480.0}
EXCERPT |= {"bearing": "skf-22240", "band_hz": (1400.0, 2800.0), "radial_n": 124800.0, "axial_n": 0.0}
EXCERPT |= {"origin": Origin.MEASURED, "state": Fault.OUTER, "nominal_rpm": 877.0}
ROLLER = {"state": Fault.ROLLER, "nominal_rpm": 353.0}
OTHER_NAME = partial(files.excerpt, condition="Roller", rpm_nominal=353)
FULL = EXCERPT | {"dataset": "torino-full", "axial_n": 49000.0, "state": Fault.INNER, "nominal_rpm": 727.0}
# By name: how the file is written, what it states, its speed with half width [rpm], seed and factor of the samples.
FILES = {
    "131.mat": (cwru("131", 1773), CWRU | DE | LOADED | {"state": Fault.OUTER}, (STATED, 1773, 1), (0, G)),
    "270_IR021_0_12kFE.mat": (cwru("270"), CWRU | FE | {"state": Fault.INNER}, (STATED, 1796, 1), (1, G)),
    "97_Normal_0_48kDE.mat": (cwru("097"), CWRU | DE | FAST | {"state": Fault.HEALTHY}, (STATED, 1796, 1), (0, G)),
    "3001_IR028_0_12kDE.mat": (cwru("056", None), CWRU | DE | {"state": Fault.INNER}, (NOMINAL, 1797, 26.955), (0, G)),
    # 24.74 Hz, the speed the inner-race records really have, is inside
    "OuterRaceFault_vload_1.mat": (partial(files.mfpt, load=25.0), MFPT, (NOMINAL, 1500, 22.5), (0, G)),
    "OuterRaceFault_vload_2.mat": (partial(files.mfpt, load="25"), MFPT, (NOMINAL, 1500, 22.5), (0, G)),
    "04_200_S1_OR_F1_R1.mat": (upm_citef, UPM | {"state": Fault.OUTER}, (NOMINAL, 200, 3), None),
    "01_200_S1_EE_F0_R1.mat": (upm_citef, UPM | {"state": Fault.HEALTHY}, (NOMINAL, 200, 3), None),
    # before the fault was milled, and with two faults at once
    "07_200_S1_RE_F0_R1.mat": (upm_citef, UPM | {"state": Fault.HEALTHY}, (NOMINAL, 200, 3), None),
    "101_200_S1_ORRE_F2_R1.mat": (upm_citef, UPM | {"state": None}, (NOMINAL, 200, 3), None),
    "OR_877rpm_sample.mat": (files.excerpt, EXCERPT, (TACHOMETER, EXCERPT_RPM, None), (0, 1)),
    "unnamed.bin": (OTHER_NAME, EXCERPT | ROLLER, (TACHOMETER, EXCERPT_RPM, None), (0, 1)),
    FULL_NAME: (rig, FULL, (TACHOMETER, FULL_RPM, None), (3, 4)),
    f"{FULL_NAME} v7.3": (partial(rig, write=files.rig_v73), FULL, (TACHOMETER, FULL_RPM, None), (3, 4)),
}


@pytest.mark.parametrize(("name", "file"), FILES.items(), ids=FILES.keys())
def test_a_file_needs_no_option(tmp_path, name, file):
    write, expected, (source, rpm, ci95_rpm), samples = file
    r = load_recording(write(tmp_path / name))
    assert {key: getattr(r, key) for key in expected} == expected
    assert (r.speed.source, r.speed.value_hz * 60) == (source, pytest.approx(rpm, rel=MEAN_ROUNDING))
    assert ci95_rpm is None or r.speed.ci95_hz * 60 == pytest.approx(ci95_rpm)
    if samples is not None:
        seed, factor = samples
        np.testing.assert_allclose(r.channels[r.channel], factor * files.vibration(seed=seed), rtol=ROUNDING)


def test_other_channels_are_not_of_the_tested_bearing(tmp_path):
    r = load_recording(files.cwru(tmp_path / "270_IR021_0_12kFE.mat", "270"), channel="DE")
    assert (r.bearing, r.state) == ("skf-6205", None)
    assert load_recording(upm_citef(tmp_path / "04_200_S1_OR_F1_R1.mat"), channel="Rod_2").bearing is None


def test_ims_asks_for_one_of_its_channels(tmp_path):
    path, channels = tmp_path / "2003.10.22.12.06.24", [files.vibration(seed=i) for i in range(8)]
    np.savetxt(path, np.stack(channels, axis=1), fmt="%.3f", delimiter="\t")
    with pytest.raises(DataError, match=r"which of 8 channels: --channel ch1 \| ch2.*ch8"):
        load_recording(path)
    r = load_recording(path, channel="ch3")
    assert (r.dataset, r.fs_hz, r.unit) == ("ims", 20000.0, "m/s2")


def test_cwru_name_against_list(tmp_path):
    with pytest.raises(DataError, match=r"name states 48000 Hz.*12000 Hz"):
        load_recording(files.cwru(tmp_path / "105_IR007_0_48kDE.mat", "105"))
    said = "its name states OR007, the data set's list IR007 for record 105: the name is used"
    for name, cautions in (("105_OR007at6_0_12kDE.mat", (said,)), ("105_IR007_0_12kDE.mat", ())):
        assert load_recording(files.cwru(tmp_path / name, "105")).cautions == cautions


def test_cwru_two_records_in_one_file(tmp_path):
    values = {f"X0{n}_DE_time": files.vibration(seed=n)[:, None] for n in (98, 99)} | {"X098RPM": 1772, "X099RPM": 1750}
    for name, expected, left in (("98.mat", 98, "099"), ("99.mat", 99, "098")):
        savemat(tmp_path / name, values)
        r = load_recording(tmp_path / name)
        np.testing.assert_allclose(r.channels["DE"], files.vibration(seed=expected) * 9.80665)
        assert f"left out: signals of record {left}" in r.notes
        assert r.speed.value_hz * 60 == pytest.approx(1772 if expected == 98 else 1750)
    savemat(tmp_path / "both.mat", values)
    with pytest.raises(DataError, match="contains cwru records 98, 99"):
        load_recording(tmp_path / "both.mat")


def full(tmp_path, signals, *, name=FULL_NAME, **given):
    """Write signals in the rig's full layout and load them."""
    return load_recording(files.rig_v5(tmp_path / name, signals), **given)


ACROSS = files.nested(files.rig_signals()["Signal_3"]["y_values"]["values"][0, 0].T.copy())
FACTOR = "y_values quantity unit_transformation factor"


@pytest.mark.parametrize(
    ("place", "value", "said"),
    [
        ("y_values values", ACROSS, 1.0),  # sensors in rows instead of columns
        (FACTOR, 1.0, G),  # values stored in g
        (FACTOR, 0.5, r"converts to 'g' by the factor 0\.5; it must be 0\.1020 or 1\.0000"),
        ("x_values number_of_values", 9999.0, "states 9999 values and contains 4096: truncated"),
        ("x_values increment", 0.0, "increment must be a positive time step"),
    ],
)
def test_signals_of_the_full_layout_in_other_forms(tmp_path, place, value, said):
    """A form is read, with samples multiplied by a factor, or refused."""
    signals = files.rig_signals()
    *parents, key = place.split()
    reduce(dict.__getitem__, parents, signals["Signal_3"])[key] = value
    if isinstance(said, str):
        with pytest.raises(DataError, match=said):
            full(tmp_path, signals)
    else:
        samples = full(tmp_path, signals).channels["sensor_4"]
        np.testing.assert_allclose(samples, said * 4 * files.vibration(seed=3), rtol=UNIT_ROUNDING)


def test_speed_in_a_wrong_unit_is_refused_until_the_user_says_it(tmp_path):
    signals = files.rig_signals(speed_rpm=700.0 * 9.5493)  # rpm stored where rad/s is announced
    with pytest.raises(DataError, match=r"or the unit.*--rpm"):
        full(tmp_path, signals)
    r = full(tmp_path, signals, rpm=700)
    assert (r.speed.value_hz * 60, r.speed.source) == (pytest.approx(700), SpeedSource.STATED)


def test_same_layout_from_another_rig_is_not_taken_for_this_one(tmp_path):
    other = partial(full, tmp_path, files.rig_signals(), name="gearbox_run_3.mat")
    with pytest.raises(DataError, match=r"--channel Signal_3\[1\].*Signal_3\[4\]"):
        other()
    r = other(channel="Signal_3[4]")
    assert (r.dataset, r.bearing, r.state, r.band_hz) == (None, None, None, None)
    assert (r.unit, r.fs_hz) == ("m/s2", 20480.0)
    assert r.speed.source is SpeedSource.TACHOMETER
