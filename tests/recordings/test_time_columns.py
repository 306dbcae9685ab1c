"""Time columns: a rate only where the times are even and their unit is known; else a question that says why."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings import Recording, load_recording
from srbval.recordings.registry import add

from . import files

N = 4096
GRID = np.arange(N) / 20480
SAVED = dict[str, Any]


def load(tmp_path: Path, values: SAVED, **given: Any) -> Recording:
    savemat(tmp_path / "a.mat", {"x": files.vibration(N)} | values, oned_as="column")
    return load_recording(tmp_path / "a.mat", unit="g", **given)


def text(tmp_path: Path, name: str, times: list[str], **given: Any) -> Recording:
    rows = (f"{t},{x:.6f}" for t, x in zip(times, files.vibration(len(times)), strict=True))
    (tmp_path / "a.csv").write_text("\n".join([f"{name},x", *rows, ""]))
    return load_recording(tmp_path / "a.csv", unit="g", **given)


@pytest.mark.parametrize(
    ("name", "fs_hz", "scale"),
    [
        *((name, 10_000, 1e3) for name in ("time_ms", "t [ms]", "Time (ms)", "time/ms", "T_MSEC")),
        *((name, 20_480, 1.0) for name in ("t", "time_s", "Time (s)", "time [seconds]", "a.t/s", "Timestamp")),
    ],
)
def test_unit_in_the_name(tmp_path: Path, name: str, fs_hz: float, scale: float) -> None:
    times = [f"{scale * i / fs_hz:.6f}" for i in range(N)]
    assert text(tmp_path, name, times).fs_hz == pytest.approx(fs_hz, rel=1e-4)


@pytest.mark.parametrize(("units", "factor"), [("ms", 1e3), ("s", 1), ("us", 1e6)])
def test_units_attribute(tmp_path: Path, units: str, factor: float) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"], file["time"] = files.vibration(N), GRID * factor
        file["time"].attrs["units"] = units
    assert load_recording(tmp_path / "a.h5", unit="g").fs_hz == pytest.approx(20_480, rel=1e-6)


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (np.arange(N) / 10, r"no sampling rate \(t has a step of 0.1, 10 Hz if in s, 10000 Hz if in ms, .*: --fs HZ"),
        (GRID * 1e6, r"a step of 48\.8281, 0\.02048 Hz if in s, 20\.48 Hz if in ms, 20480 Hz if in us\): --fs HZ"),
        (GRID / 1e6, r"2\.048e\+10 Hz if in s"),
        (np.arange(N), r"\(t counts the samples"),
        (np.arange(N) + 1.0, r"\(t counts the samples"),
    ],
)
def test_times_without_a_unit_that_mean_no_vibration_record(tmp_path: Path, times: np.ndarray, said: str) -> None:
    with pytest.raises(DataError, match=said):
        load(tmp_path, {"t": times})


@pytest.mark.parametrize(("digits", "fs_hz"), [(5, 20_480.0), (6, 25_600.0), (7, 20_480.0), (9, 10_000.0)])
def test_rounded_times_are_even(tmp_path: Path, digits: int, fs_hz: float) -> None:
    recording = text(tmp_path, "t", [f"{i / fs_hz:.{digits}f}" for i in range(N)])
    assert recording.fs_hz == pytest.approx(fs_hz, rel=1e-4)
    assert recording.cautions == ()


def uneven(kind: str) -> np.ndarray:
    times, rng = GRID.copy(), np.random.default_rng(0)
    if kind == "jitter":
        times += rng.uniform(-0.02, 0.02, N) / 20480
    elif kind == "gaps":
        times[1000:] += 3 / 20480
        times[3000:] += 500 / 20480
    elif kind == "repeated":
        times[10:] -= 1 / 20480
    elif kind == "backwards":
        times[2000:] -= 5 / 20480
    elif kind == "drift":
        times = times + 0.01 * times**2
    elif kind == "rounded":
        times = times.round(3)
    return times


@pytest.mark.parametrize(
    ("kind", "said"),
    [
        ("jitter", r"\d{4} otherwise uneven of 4095 steps, the worst off by 3\.\d+ %"),
        ("gaps", r"2 gaps of 4095 steps, the worst off by 5e\+04 %"),
        ("repeated", r"1 repeated of 4095 steps, the worst off by 100 %"),
        ("backwards", r"1 backwards of 4095 steps, the worst off by 500 %"),
        ("drift", r"2042 otherwise uneven of 4095 steps, the worst off by 0\.2 %"),
        ("rounded", r"do not run forwards: \d+ of 4095 steps"),
    ],
)
def test_uneven_times_leave_the_rate_open(tmp_path: Path, kind: str, said: str) -> None:
    """The absolute tolerance of a microsecond took jitter of 2 % at 20 kHz for even."""
    with pytest.raises(DataError, match=rf"no sampling rate \(the times of t.*{said}\): --fs HZ"):
        load(tmp_path, {"t": uneven(kind)})
    (said_once,) = load(tmp_path, {"t": uneven(kind)}, fs_hz=20_480.0).cautions
    assert said_once.endswith("read as even, at 20480 Hz")
    assert load(tmp_path, {"t": uneven(kind), "fs": 20_480.0}).cautions == (said_once,)


def test_a_rate_that_contradicts_the_times(tmp_path: Path) -> None:
    said = "the times of t mean 20480 Hz, read at 25600 Hz"
    assert load(tmp_path, {"t": GRID, "fs": 25_600.0}).cautions == (said,)
    assert load(tmp_path, {"t": GRID}, fs_hz=25_600.0).cautions == (said,)
    assert load(tmp_path, {"t": GRID, "fs": 20_480.0}).cautions == ()
    assert load(tmp_path, {"t": GRID * 1e3}, fs_hz=20_480.0).cautions == ()
    assert load(tmp_path, {"t": GRID * 1e3, "fs": 30_000.0}).cautions != ()
    assert load(tmp_path, {"t": np.arange(N)}, fs_hz=30_000.0).cautions == ()


def test_names_that_contradict_each_other(tmp_path: Path) -> None:
    """A value was silently not used."""
    with pytest.raises(DataError, match=r"no sampling rate \(fs = 8000 and sr = 9000 contradict each other\): --fs HZ"):
        load(tmp_path, {"fs": 8000.0, "sr": 9000.0})
    with pytest.raises(DataError, match="fs = 8000 and sr = 9000 contradict each other"):
        load(tmp_path, {"fs": 8000.0, "sr": 9000.0, "t": uneven("gaps")})
    with pytest.raises(
        DataError, match=r"rpm = 1200 and mean_rpm = 1500 contradict each other. State the speed: --rpm"
    ):
        load(tmp_path, {"fs": 8000.0, "rpm": 1200.0, "mean_rpm": 1500.0})
    with pytest.raises(DataError, match=r"\(fs = -1 is not within 500 to 5e\+06, perhaps in another unit\)"):
        load(tmp_path, {"fs": -1.0})
    with pytest.raises(DataError, match=r"\(fs = 20\.48 is not within 500 to 5e\+06, perhaps in another unit\)"):
        load(tmp_path, {"fs": 20.48})


def test_what_is_left_out_is_said(tmp_path: Path) -> None:
    notes = load(tmp_path, {"fs": 8000.0, "short": np.arange(100.0), "no": np.arange(1, N + 1)}).notes
    assert "left out, no signal of 256 samples or more: short (100, 1), no (4096, 1)" in notes
    notes = load(tmp_path, {"fs": 8000.0, "y": files.vibration(300)}, channel="x").notes
    assert "left out, of another length, rate or unit: y" in notes
    (entry,) = add(tmp_path).recordings
    assert entry.channels == ("x", "y")


def test_single_precision_times_are_even(tmp_path: Path) -> None:
    assert load(tmp_path, {"t": (100 + GRID).astype(np.float32)}).fs_hz == pytest.approx(20_480, rel=1e-3)


def test_times_that_are_none(tmp_path: Path) -> None:
    times = np.where(np.arange(N) == 7, np.nan, GRID)
    assert load(tmp_path, {"t": times, "fs": 20_480.0}).cautions == (
        "1 of the times of t are not finite numbers; read as even, at 20480 Hz",
    )
