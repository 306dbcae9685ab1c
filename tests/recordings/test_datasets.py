"""Descriptions of the known data sets, files in the layouts of the open ones, and real ones that are at hand."""

import re

import numpy as np
import pytest
from scipy.io import savemat

from srbval.bearing import Fault, known_bearings
from srbval.errors import DataError
from srbval.recordings import SpeedSource, load_recording
from srbval.recordings.datasets.description import known_datasets
from srbval.storage.installation import shipped_folder

from . import files

BAND_EDGE = 0.01  # upper band edges are stated as round numbers
SETS = {"cwru", "mfpt", "torino-excerpts", "torino-full", "hit-sm", "uestc", "ims", "upm-citef"}


def test_every_description_is_read_under_its_files_name():
    names = [path.stem for path in sorted(shipped_folder("data_manifest").glob("*.toml"))]
    assert [d.name for d in known_datasets()] == names
    assert set(names) == SETS


@pytest.mark.parametrize("d", known_datasets(), ids=lambda d: d.name)
def test_names_patterns_addresses_and_bands_are_usable(d):
    """All open sets share a band: 500 Hz to 10 kHz, or to 0.46 of a rate too low for it; nothing is fitted to a set."""
    assert {c.bearing for c in d.channels} - {None} <= set(known_bearings())
    for pattern in (d.match.file, *d.match.variables, *(c.variable for c in d.channels)):
        re.compile(pattern or "")
    assert d.url.startswith("https://")
    assert all(f.sha256 is None or re.fullmatch("[0-9a-f]{64}", f.sha256) for f in d.files)
    assert d.access in ("open", "restricted")
    assert all(b.low_hz < b.high_hz and b.reason for b in d.bands)
    for band in () if d.name.startswith("torino") else d.bands:
        fs_hz = band.fs_hz or d.rate.value_hz or 1e6
        assert band.low_hz == 500.0
        assert band.high_hz == pytest.approx(min(10000.0, 0.46 * fs_hz), rel=BAND_EDGE)


@pytest.mark.parametrize(
    ("name", "number", "rpm", "fs_hz", "channel", "bearing", "state", "source"),
    [
        ("131.mat", "131", 1773, 12000.0, "DE", "skf-6205", Fault.OUTER, SpeedSource.STATED),
        ("270_IR021_0_12kFE.mat", "270", 1796, 12000.0, "FE", "skf-6203", Fault.INNER, SpeedSource.STATED),
        ("97_Normal_0_48kDE.mat", "097", 1796, 48000.0, "DE", "skf-6205", Fault.HEALTHY, SpeedSource.STATED),
        ("3001_IR028_0_12kDE.mat", "056", None, 12000.0, "DE", "skf-6205", Fault.INNER, SpeedSource.NOMINAL),
    ],
)
def test_cwru_by_its_number(tmp_path, name, number, rpm, fs_hz, channel, bearing, state, source):
    r = load_recording(files.cwru(tmp_path / name, number, rpm=rpm))
    assert (r.fs_hz, r.channel, r.bearing, r.state) == (fs_hz, channel, bearing, state)
    assert r.band_hz == (500.0, 10000.0 if fs_hz > 40000 else 5500.0)
    assert (r.speed.source, r.speed.value_hz * 60) == (source, pytest.approx(rpm or 1797))
    assert r.nominal_rpm == (1772 if number == "131" else 1797)
    assert r.speed.ci95_hz == pytest.approx(1 / 60 if rpm else 0.015 * 1797 / 60)
    np.testing.assert_allclose(r.channels[channel], files.vibration(seed=channel == "FE") * 9.80665)
    if channel == "FE":
        other = load_recording(tmp_path / name, channel="DE")
        assert (other.bearing, other.state) == ("skf-6205", None)


def test_cwru_name_against_list(tmp_path):
    with pytest.raises(DataError, match=r"name says 48000 Hz.*12000 Hz"):
        load_recording(files.cwru(tmp_path / "105_IR007_0_48kDE.mat", "105"))
    said = "its name says OR007, the data set's list IR007 for record 105: the name is used"
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
    with pytest.raises(DataError, match="holds cwru records 98, 99"):
        load_recording(tmp_path / "both.mat")


@pytest.mark.parametrize("load", [25.0, "25"])
def test_mfpt_struct(tmp_path, load):
    r = load_recording(files.mfpt(tmp_path / "OuterRaceFault_vload_1.mat", load))
    assert (r.state, r.bearing, r.fs_hz, r.unit) == (Fault.OUTER, "mfpt-nice", 48828.0, "m/s2")
    assert r.radial_n == pytest.approx(25 * 4.4482216)
    assert (r.speed.source, r.speed.value_hz) == (SpeedSource.NOMINAL, pytest.approx(25.0))
    assert r.speed.ci95_hz > 0.26  # 24.74 Hz, the speed the inner-race records really have, is inside


def test_ims_names_its_channels(tmp_path):
    path = tmp_path / "2003.10.22.12.06.24"
    np.savetxt(path, np.stack([files.vibration(seed=i) for i in range(8)], axis=1), fmt="%.3f", delimiter="\t")
    with pytest.raises(DataError, match=r"which of 8 channels: --channel ch1 \| ch2.*ch8"):
        load_recording(path)
    r = load_recording(path, channel="ch3")
    assert (r.dataset, r.fs_hz, r.unit) == ("ims", 20000.0, "m/s2")


@pytest.mark.recordings
@pytest.mark.parametrize(
    ("name", "fs_hz", "rpm", "channel", "samples"),
    [
        ("cwru/174_IR014_0_48kDE.mat", 48000, 1796, "DE", 63788),  # its variables are called X173
        ("cwru/278_IR007_0_12kFE.mat", 12000, 1796, "FE", 121535),  # carries a stray array
        ("cwru/3001_IR028_0_12kDE.mat", 12000, 1797, "DE", 120801),  # variables of another record, no rpm
        ("mfpt/InnerRaceFault_vload_1.mat", 48828, 1500, "gs", 146484),
        ("hit_sm/SpectraQuest/Normal_1200.mat", 51200, 1200, "vibration", 262144),
    ],
)
def test_real_traps(recordings_dir, name, fs_hz, rpm, channel, samples):
    r = load_recording(recordings_dir / name)
    assert (r.fs_hz, r.channel, r.samples) == (fs_hz, channel, samples)
    assert r.speed.value_hz * 60 == pytest.approx(rpm)


@pytest.mark.parametrize(
    ("name", "rpm", "state"),
    [
        ("04_500_S1_OR_F1_R1.mat", 500, Fault.OUTER),
        ("01_500_S1_EE_F0_R1.mat", 500, Fault.HEALTHY),
        ("07_200_S1_RE_F0_R1.mat", 200, Fault.HEALTHY),  # before the fault was milled
        ("101_200_S1_ORRE_F2_R1.mat", 200, None),  # two faults at once
    ],
)
def test_upm_citef_needs_no_option(tmp_path, name, rpm, state):
    values = {"Fs": 40000.0, **{f"Rod_{i}": 1.9 + 0.1 * files.vibration(seed=i)[:, None] for i in (3, 2, 1)}}
    savemat(tmp_path / name, values)
    r = load_recording(tmp_path / name)
    assert (r.dataset, r.channel, r.bearing, r.unit, r.fs_hz) == ("upm-citef", "Rod_1", "fag-22205", "V", 40000.0)
    assert (r.nominal_rpm, r.state, r.band_hz) == (rpm, state, (500.0, 10000.0))
    assert r.speed.source is SpeedSource.NOMINAL
    assert load_recording(tmp_path / name, channel="Rod_2").bearing is None  # not the tested bearing's sensor
