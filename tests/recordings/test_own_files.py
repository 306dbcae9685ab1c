"""Runs and stand-ins: written to HDF5, read back through the same loader, open to xarray."""

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray as xr

from srbval.bearing import Fault, load_bearing
from srbval.errors import DataError
from srbval.recordings import Origin, SpeedSource, load_recording
from srbval.recordings.synthetic_record import write_synthetic_record

from . import files

SHAFT_HZ = 14.3
# The stand-in's speed fluctuates by 0.1 %, slowly: ten standard deviations.
FLUCTUATION = 0.01
# Half width of the search, relative: the lines of other faults lie farther away.
NEAR = 0.005
# A fault's own line, over the local median of the amplitude spectrum.
LINE_SNR = 10


def run_file(path: Path, **attributes: object) -> Path:
    defaults = {"schema_version": 1, "srbval_kind": "run", "name": "a run", "fs_hz": 61440.0, "unit": "m/s2"}
    more = {"bearing": "skf-22240", "state": "outer", "shaft_speed_hz": 11.8333, "radial_n": 124800.0}
    with h5py.File(path, "w") as file:
        file.attrs.update(defaults | more | attributes)
        for i, axis in enumerate("xyz"):
            file[f"acceleration_{axis}_m_s2"] = files.vibration(seed=i)
        file["cage_speed_rad_s"] = files.vibration(seed=9)
    return path


def test_run_becomes_a_simulated_recording_with_two_axes(tmp_path: Path) -> None:
    r = load_recording(run_file(tmp_path / "run.h5"))
    assert (r.origin, r.axes, r.channel, r.unit) == (Origin.SIMULATED, ("x", "y"), None, "m/s2")
    assert (r.fs_hz, r.state, r.bearing, r.radial_n) == (61440.0, Fault.OUTER, "skf-22240", 124800.0)
    assert r.speed is not None
    assert (r.speed.value_hz, r.speed.source) == (11.8333, SpeedSource.PRESCRIBED)
    np.testing.assert_array_equal(r.channels["z"], files.vibration(seed=2))
    assert load_recording(tmp_path / "run.h5", channel="y").axes is None


@pytest.mark.parametrize(
    ("attributes", "message"),
    [
        ({"srbval_kind": "other"}, "srbval_kind is 'other'"),
        ({"state": "rusty"}, "state 'rusty'"),
        (
            {"status": "cage-lost", "reason": "the cage stopped"},
            r"run failed \(cage-lost: the cage stopped\)",
        ),
    ],
)
def test_run_that_cannot_be_read(tmp_path: Path, attributes: dict[str, object], message: str) -> None:
    with pytest.raises(DataError, match=message):
        load_recording(run_file(tmp_path / "run.h5", **attributes))


@pytest.mark.parametrize("state", list(Fault))
def test_stand_in_shows_its_fault_line_and_no_other(tmp_path: Path, state: Fault) -> None:
    """Highest line near each kinematic line of the squared envelope, over the local median."""
    from scipy.signal import butter, hilbert, sosfiltfilt

    r = write_synthetic_record(tmp_path / "s.h5", state=state, shaft_hz=SHAFT_HZ, seconds=10, seed=3)
    band = butter(4, (1400, 2800), "bandpass", fs=r.fs_hz, output="sos")
    envelope = np.abs(hilbert(sosfiltfilt(band, r.channels["acceleration"]))) ** 2
    spectrum = np.abs(np.fft.rfft(envelope - envelope.mean()))
    hz = np.fft.rfftfreq(len(envelope), 1 / r.fs_hz)
    assert r.speed is not None
    lines = load_bearing("skf-22240").orders.at(r.speed.value_hz)
    snr = {}
    for fault, at in (
        (Fault.OUTER, lines.bpfo_hz),
        (Fault.INNER, lines.bpfi_hz),
        (Fault.ROLLER, 2 * lines.bsf_hz),
    ):
        near = np.abs(hz - at) < NEAR * at
        snr[fault] = spectrum[near].max() / np.median(spectrum[np.abs(hz - at) < 20])
    for fault, ratio in snr.items():
        assert (ratio > LINE_SNR) == (fault is state), (fault, ratio)


def test_stand_in_opens_in_xarray_with_names_and_units(tmp_path: Path) -> None:
    write_synthetic_record(tmp_path / "s.h5", state=Fault.HEALTHY, shaft_hz=SHAFT_HZ, seconds=0.5, seed=1)
    with xr.open_dataset(tmp_path / "s.h5", engine="h5netcdf") as data:
        variable = data["acceleration_m_s2"]
        assert variable.dims == ("time_s",)
        assert (variable.attrs["units"], data["time_s"].attrs["units"]) == ("m s-2", "s")
        assert "stand-in" in variable.attrs["long_name"]


@pytest.mark.parametrize(
    "scene", ["[" * 50_000, '{"speed_profile": 1' + "0" * 5000 + "}", "[]", '{"speed_profile": [[]]}']
)
def test_a_hostile_scene_in_a_run(scene: str, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="scene stored with the run"):
        load_recording(run_file(tmp_path / "run.h5", scene=scene))


def test_stand_in_repeats_with_its_seed_only(tmp_path: Path) -> None:
    first, again, other = (
        write_synthetic_record(tmp_path / f"{i}.h5", state=Fault.INNER, shaft_hz=SHAFT_HZ, seconds=0.5, seed=seed)
        for i, seed in enumerate((5, 5, 6))
    )
    np.testing.assert_array_equal(first.channels["acceleration"], again.channels["acceleration"])
    assert not np.array_equal(first.channels["acceleration"], other.channels["acceleration"])
    assert (tmp_path / "0.h5").read_bytes() == (tmp_path / "1.h5").read_bytes()
