"""Result files of simulators: Simulink's structures and arrays, MATLAB's objects, Modelica's results."""

import csv
import sys
import types
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings import Origin, RecordingSettings, load_recording
from srbval.recordings.loaders.matlab import add_objects

from . import files

N, FS_HZ = 4096, 20_480.0
TIMES, X, Y = np.arange(N) / FS_HZ, files.vibration(N), files.vibration(N, 1)
SINGLE = 1e-6  # digits of single precision


def load(path, **settings):
    return load_recording(path, RecordingSettings(**settings))


def structure(label, values, block="bearing/Sensor"):
    return {"values": values, "dimensions": 1.0, "label": label, "blockName": block}


SIGNALS = np.empty(2, dtype=object)
SIGNALS[:] = [structure("acc_x [m/s^2]", X[:, None]), structure("acc_y [m/s^2]", Y.reshape(1, 1, -1))]


@pytest.mark.parametrize(
    ("contents", "channel", "settings"),
    [
        ({"out": {"time": TIMES[:, None], "signals": SIGNALS, "blockName": "bearing/Scope"}}, "acc_y [m/s^2]", {}),
        ({"out": {"time": TIMES[:, None], "signals": structure("", np.stack([X, Y], 1))}}, "Sensor[2]", {"unit": "g"}),
        ({"tout": TIMES[:, None], "yout": np.stack([X, Y], axis=1)}, "yout[2]", {"unit": "g"}),
        ({"ScopeData": np.stack([TIMES, X, Y], axis=1)}, "ScopeData[3]", {"unit": "g"}),
        ({"ans": np.stack([TIMES, X, Y])}, "ans[3]", {"unit": "g"}),  # block "To File": times in the first row
    ],
)
def test_simulink(tmp_path, contents, channel, settings):
    savemat(tmp_path / "out.mat", contents)
    with pytest.raises(DataError, match="which of 2 channels"):
        load(tmp_path / "out.mat", **settings)
    found = load(tmp_path / "out.mat", channel=channel, **settings)
    assert found.fs_hz == pytest.approx(FS_HZ)
    np.testing.assert_allclose(found.channels[channel], Y * (9.80665 if settings else 1.0))


def test_times_of_the_channel_that_is_chosen(tmp_path):
    """Two blocks log at two rates."""
    slow = {"time": np.arange(1000) / 2e3, "signals": structure("slow", X[:1000])}
    fast = {"time": TIMES, "signals": structure("fast", X)}
    savemat(tmp_path / "out.mat", {"a": slow, "b": fast}, oned_as="column")
    rates = [load(tmp_path / "out.mat", unit="m/s2", channel=name).fs_hz for name in ("slow", "fast")]
    assert rates == pytest.approx([2e3, FS_HZ])


def test_objects_of_matlab(tmp_path, monkeypatch):
    """Without the library the message has both ways out; with it, a series and a timetable are read."""
    import pandas as pd

    monkeypatch.setitem(sys.modules, "matio", None)
    with pytest.raises(DataError, match=r"need the library mat-io \(.*install mat-io\). Or export a table"):
        add_objects(tmp_path, {})
    assert "left out" in add_objects(tmp_path, {"x": X})[0]
    info = types.SimpleNamespace(
        properties={"Time_": np.zeros((0, 0)), "Start_": np.zeros((1, 1)), "Increment_": np.full((1, 1), 1 / FS_HZ)}
    )
    series = types.SimpleNamespace(properties={"Data_": X[:, None], "TimeInfo": info, "Name": np.array(["acc"])})
    table = pd.DataFrame({"acc_x": X}, index=pd.to_timedelta(TIMES, unit="s"))
    box = np.empty((1, 1), dtype=object)
    box[0, 0] = types.SimpleNamespace(properties={"Values": series})
    contents = {"log": types.SimpleNamespace(properties={"Elements": box}), "table": table}
    monkeypatch.setitem(sys.modules, "matio", types.SimpleNamespace(load_from_mat=lambda _: contents))
    found: dict[str, Any] = {}
    assert add_objects(tmp_path, found) == ()
    np.testing.assert_array_equal(found["log.Elements.Values"][:, 0], X)
    np.testing.assert_allclose(found["log.Elements.Values.time [s]"], TIMES, rtol=SINGLE)
    np.testing.assert_array_equal(found["table.acc_x"], X)
    np.testing.assert_allclose(found["table.time"], TIMES, atol=1e-8)


@pytest.mark.filterwarnings("ignore:duration_to_mat")
def test_a_timetable_that_mat_io_wrote(tmp_path):
    matio, pd = pytest.importorskip("matio"), pytest.importorskip("pandas")
    table = pd.DataFrame({"acc_x": X}, index=pd.Index(pd.to_timedelta(TIMES, unit="s"), name="Time"))
    for version in ("v7", "v7.3"):
        path = tmp_path / f"{version}.mat"
        matio.save_to_mat(str(path), {"log": table}, version=version)
        assert load(path, unit="m/s2").fs_hz == pytest.approx(FS_HZ, rel=1e-5)


def letters(*texts):
    longest = max(map(len, texts))
    return np.array([list(text.ljust(longest)) for text in texts])


def modelica(path, layout, times=TIMES):
    """A model with a parameter, two variables, and the second one again with the other sign."""
    names = ("Time", "bearing.d", "ring.a[1]", "ring.a[2]", "ring.f", "ring.phi")
    described = (
        "Time in [s]",
        "Diameter [m]",
        "Acceleration [m/s2|m/s2]",
        "[m/s2]",
        "",
        "[rad]",
    )
    info = np.array([[0, 1, 0, -1], [1, 1, 0, 0], [2, 2, 0, -1], [2, 3, 0, -1], [2, -3, 0, -1], [2, 4, 0, -1]])
    contents = {
        "name": letters(*names),
        "description": letters(*described),
        "dataInfo": info.astype(np.int32),
        "data_1": np.array([[0.3], [0.3]]),
        "data_2": np.stack([times, X, Y, 30 * times], axis=1).astype(np.float32 if layout == "binNormal" else float),
    }
    if layout == "binTrans":
        contents = {name: np.ascontiguousarray(value.T) for name, value in contents.items()}
    savemat(path, {"Aclass": letters("Atrajectory", "1.1", "", layout)} | contents, format="4", appendmat=False)
    return path


@pytest.mark.parametrize("layout", ["binTrans", "binNormal"])
def test_modelica(tmp_path, layout):
    path = modelica(tmp_path / "dsres", layout)
    with pytest.raises(DataError, match=r"no channel 'ring.b'; it has ring.a\[1\], ring.a\[2\], ring.f, ring.phi"):
        load(path, channel="ring.b")
    found = load(path, channel="ring.a[2]", cage_channel="ring.phi", rpm=600.0)
    assert (found.origin, found.unit, found.fs_hz) == (Origin.SIMULATED, "m/s2", pytest.approx(FS_HZ, rel=1e-4))
    np.testing.assert_allclose(found.channels["ring.a[2]"], Y, rtol=SINGLE)
    assert found.cage_ratio == pytest.approx(30 / (2 * np.pi) / 10, rel=1e-5)
    np.testing.assert_allclose(load(path, channel="ring.f", unit="m/s2").channels["ring.f"], -Y, rtol=SINGLE)
    with pytest.raises(DataError, match="cannot be declared measured"):
        load(path, channel="ring.a[2]", origin=Origin.MEASURED)


def test_modelica_s_table_of_hundreds_of_columns(tmp_path):
    names = ["time", *(f"body.r[{i},{i + 1}]" for i in range(300))]
    with (tmp_path / "res.csv").open("w") as stream:
        stream.write(",".join(f'"{name}"' for name in names) + "\n")
        csv.writer(stream).writerows(np.column_stack([TIMES[:300], *[np.round(X[:300], 4)] * 300]).tolist())
    assert load(tmp_path / "res.csv", channel="body.r[7,8]", unit="g").samples == 300
    with pytest.raises(DataError, match=r"no channel 'body.r\[7,9\]'; the nearest of 300 are .*body.r\[7,8\], "):
        load(tmp_path / "res.csv", channel="body.r[7,9]")
