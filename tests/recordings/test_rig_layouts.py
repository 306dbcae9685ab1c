"""The rig's recordings: the open excerpts' layout and the full one, in MATLAB v5 and v7.3."""

import h5py
import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings import Origin, SpeedSource, load_recording

from . import files

FULL_NAME = "IR_727rpm_124.8kN_49kN.mat"
ROUNDING = 1e-15  # one multiplication by a factor that is not exactly representable
UNIT_ROUNDING = 1e-12  # two factors applied one after the other
MEAN_ROUNDING = 1e-9  # a mean over the samples in another order, or of rad/s in place of rpm
WITHIN_RPM = 1  # the made signal scatters by 0.3 rpm about 700


@pytest.fixture
def full(tmp_path):
    """Write the rig's full layout and load it."""

    def write(signals, *, name=FULL_NAME, **given):
        return load_recording(files.rig_v5(tmp_path / name, signals), **given)

    return write


def test_excerpt_needs_no_option(tmp_path):
    r = load_recording(files.excerpt(tmp_path / "OR_877rpm_sample.mat"))
    assert (r.origin, r.dataset, r.channel) == (Origin.MEASURED, "torino-excerpts", "sensor_4")
    assert (r.unit, r.fs_hz, r.bearing, r.state) == ("m/s2", 20480.0, "skf-22240", Fault.OUTER)
    assert (r.radial_n, r.axial_n, r.nominal_rpm) == (124800.0, 0.0, 877.0)
    assert r.band_hz == (1400.0, 2800.0)
    assert r.speed.source is SpeedSource.TACHOMETER
    assert r.speed.value_hz * 60 == pytest.approx(np.mean(858.0 + 0.5 * files.vibration(128, 1)), abs=MEAN_ROUNDING)
    np.testing.assert_array_equal(r.channels["sensor_4"], files.vibration())
    renamed = load_recording(files.excerpt(tmp_path / "unnamed.bin", condition="Roller", rpm_nominal=353))
    assert (renamed.dataset, renamed.state, renamed.nominal_rpm) == ("torino-excerpts", Fault.ROLLER, 353.0)


@pytest.mark.parametrize("write", [files.rig_v5, files.rig_v73])
def test_full_layout_needs_no_option(tmp_path, write):
    """Signals are found by their quantity, and the speed is the record's, not its name's."""
    first, second, third = files.rig_signals(speed_rpm=700.0).values()
    r = load_recording(write(tmp_path / FULL_NAME, {"Signal_1": third, "Signal_7": first, "Signal_2": second}))
    assert r.speed.source is SpeedSource.TACHOMETER
    assert r.speed.value_hz * 60 == pytest.approx(np.mean(700.0 + 0.3 * files.vibration(20, 9)), rel=MEAN_ROUNDING)
    assert (r.dataset, r.channel, r.unit, r.fs_hz) == ("torino-full", "sensor_4", "m/s2", 20480.0)
    assert (r.state, r.bearing, r.nominal_rpm) == (Fault.INNER, "skf-22240", 727.0)
    assert (r.radial_n, r.axial_n) == (124800.0, 49000.0)
    np.testing.assert_allclose(r.channels["sensor_4"], 4 * files.vibration(seed=3), rtol=ROUNDING)
    assert list(r.channels) == ["sensor_1", "sensor_2", "sensor_3", "sensor_4"]
    assert "left out: Signal_7 (°C)" in r.notes


def test_sensors_across_instead_of_down(full):
    signals = files.rig_signals()
    struct = signals["Signal_3"]
    struct["y_values"]["values"] = files.nested(struct["y_values"]["values"][0, 0].T.copy())
    np.testing.assert_allclose(full(signals).channels["sensor_4"], 4 * files.vibration(seed=3), rtol=ROUNDING)


def test_unit_factor(full):
    """Values stored in g are converted; a factor that leads nowhere is refused."""
    signals = files.rig_signals()
    transformation = signals["Signal_3"]["y_values"]["quantity"]["unit_transformation"]
    transformation["factor"] = 1.0
    in_si = 4 * 9.80665 * files.vibration(seed=3)
    np.testing.assert_allclose(full(signals).channels["sensor_4"], in_si, rtol=UNIT_ROUNDING)
    transformation["factor"] = 0.5
    with pytest.raises(DataError, match=r"Signal_3 leads to 'g' by 0\.5; 0\.1020 or 1\.0000 is understood"):
        full(signals)


def test_fewer_values_than_announced_is_truncated(full):
    signals = files.rig_signals()
    signals["Signal_3"]["x_values"]["number_of_values"] = 9999.0
    with pytest.raises(DataError, match="announces 9999 values, holds 4096"):
        full(signals)


def test_speed_in_a_wrong_unit_is_refused_until_the_user_says_it(full):
    signals = files.rig_signals(speed_rpm=700.0 * 9.5493)  # rpm stored where rad/s is announced
    with pytest.raises(DataError, match=r"wrong unit.*--rpm"):
        full(signals)
    r = full(signals, rpm=700)
    assert (r.speed.value_hz * 60, r.speed.source) == (pytest.approx(700), SpeedSource.STATED)


def test_same_layout_from_another_rig_is_not_taken_for_this_one(full):
    name = "gearbox_run_3.mat"
    with pytest.raises(DataError, match=r"--channel Signal_3\[1\].*Signal_3\[4\]"):
        full(files.rig_signals(), name=name)
    r = full(files.rig_signals(), name=name, channel="Signal_3[4]")
    assert (r.dataset, r.bearing, r.state, r.band_hz) == (None, None, None, None)
    assert (r.unit, r.fs_hz) == ("m/s2", 20480.0)
    assert r.speed.source is SpeedSource.TACHOMETER


def test_v73_without_matlabs_attributes(tmp_path):
    path = files.rig_v73(tmp_path / FULL_NAME, files.rig_signals())
    with h5py.File(path, "r+") as file:
        file.visititems(lambda _, item: item.attrs.pop("MATLAB_class", None) and None)
    r = load_recording(path)
    np.testing.assert_allclose(r.channels["sensor_4"], 4 * files.vibration(seed=3), rtol=ROUNDING)
    assert r.speed.value_hz * 60 == pytest.approx(700, abs=WITHIN_RPM)
