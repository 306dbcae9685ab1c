"""Time columns: a rate only where the times are even and their unit is known; else a question that says why."""

import h5py
import numpy as np
import pytest
from scipy.io import savemat

from srbval.errors import DataError
from srbval.recordings import load_recording
from srbval.recordings.registry import add

from . import files

N = 4096
GRID = np.arange(N) / 20480
JITTER = np.random.default_rng(0).uniform(-0.02, 0.02, N) / 20480
SAMPLE = np.arange(N)


def load(tmp_path, values, **given):
    savemat(tmp_path / "a.mat", {"x": files.vibration(N)} | values, oned_as="column")
    return load_recording(tmp_path / "a.mat", unit="g", **given)


def text(tmp_path, name, times):
    rows = (f"{t},{x:.6f}" for t, x in zip(times, files.vibration(len(times)), strict=True))
    (tmp_path / "a.csv").write_text("\n".join([f"{name},x", *rows, ""]))
    return load_recording(tmp_path / "a.csv", unit="g")


@pytest.mark.parametrize(
    ("name", "fs_hz", "scale"),
    [
        *((name, 10_000, 1e3) for name in ("time_ms", "t [ms]", "Time (ms)", "time/ms", "T_MSEC")),
        *((name, 20_480, 1.0) for name in ("t", "time_s", "Time (s)", "time [seconds]", "a.t/s", "Timestamp")),
    ],
)
def test_unit_in_the_name(tmp_path, name, fs_hz, scale):
    times = [f"{scale * i / fs_hz:.6f}" for i in range(N)]
    assert text(tmp_path, name, times).fs_hz == pytest.approx(fs_hz, rel=1e-4)


@pytest.mark.parametrize(("units", "factor"), [("ms", 1e3), ("s", 1), ("us", 1e6)])
def test_units_attribute(tmp_path, units, factor):
    with h5py.File(tmp_path / "a.h5", "w") as file:
        file["x"], file["time"] = files.vibration(N), GRID * factor
        file["time"].attrs["units"] = units
    assert load_recording(tmp_path / "a.h5", unit="g").fs_hz == pytest.approx(20_480, rel=1e-6)


@pytest.mark.parametrize(("digits", "fs_hz"), [(5, 20_480.0), (6, 25_600.0), (7, 20_480.0), (9, 10_000.0)])
def test_rounded_times_are_even(tmp_path, digits, fs_hz):
    recording = text(tmp_path, "t", [f"{i / fs_hz:.{digits}f}" for i in range(N)])
    assert recording.fs_hz == pytest.approx(fs_hz, rel=1e-4)
    assert recording.cautions == ()


def test_single_precision_times_are_even(tmp_path):
    assert load(tmp_path, {"t": (100 + GRID).astype(np.float32)}).fs_hz == pytest.approx(20_480, rel=1e-3)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        # times without a unit that mean no vibration record
        ({"t": SAMPLE / 10}, r"\(t has a step of 0.1, 10 Hz if in s, 10000 Hz if in ms, .*: --fs HZ"),
        (
            {"t": GRID * 1e6},
            r"a step of 48\.8281, 0\.02048 Hz if in s, 20\.48 Hz if in ms, 20480 Hz if in us\): --fs HZ",
        ),
        ({"t": GRID / 1e6}, r"2\.048e\+10 Hz if in s"),
        ({"t": SAMPLE}, r"\(t counts the samples"),
        ({"t": SAMPLE + 1.0}, r"\(t counts the samples"),
        # names that contradict each other, and rates in another unit
        ({"fs": 8000.0, "sr": 9000.0}, r"\(fs = 8000 and sr = 9000 contradict each other\): --fs HZ"),
        ({"fs": 8000.0, "sr": 9000.0, "t": GRID + JITTER}, "fs = 8000 and sr = 9000 contradict each other"),
        ({"fs": -1.0}, r"\(fs = -1 is not within 500 to 5e\+06, perhaps in another unit\)"),
        ({"fs": 20.48}, r"\(fs = 20\.48 is not within 500 to 5e\+06, perhaps in another unit\)"),
    ],
)
def test_the_rate_stays_open(tmp_path, values, said):
    with pytest.raises(DataError, match=f"no (sampling rate|even times) .*{said}"):
        load(tmp_path, values)


def test_speeds_that_contradict_each_other(tmp_path):
    said = "rpm = 1200 and mean_rpm = 1500 contradict each other. State the speed: --rpm"
    with pytest.raises(DataError, match=said):
        load(tmp_path, {"fs": 8000.0, "rpm": 1200.0, "mean_rpm": 1500.0})


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (GRID + JITTER, r"\d{4} otherwise uneven of 4095 steps, the worst off by 3\.\d+ %"),
        (GRID + 3 / 20480 * (SAMPLE >= 1000) + 500 / 20480 * (SAMPLE >= 3000), r"2 gaps .*, the worst off by 5e\+04 %"),
        (GRID - 1 / 20480 * (SAMPLE >= 10), r"1 repeated of 4095 steps, the worst off by 100 %"),
        (GRID - 5 / 20480 * (SAMPLE >= 2000), r"1 backwards of 4095 steps, the worst off by 500 %"),
        (GRID + 0.01 * GRID**2, r"2042 otherwise uneven of 4095 steps, the worst off by 0\.2 %"),
        (GRID.round(3), r"do not run forwards: \d+ of 4095 steps"),
    ],
    ids=["jitter", "gaps", "repeated", "backwards", "drift", "rounded"],
)
def test_uneven_times_leave_the_rate_open(tmp_path, times, said):
    """A tolerance of a microsecond would take jitter of 2 % at 20 kHz for even."""
    remedy = "export them again, rising" if "run forwards" in said or "backwards" in said else "--resample HZ"
    with pytest.raises(DataError, match=rf"no even times \(the times of t.*{said}\): {remedy}") as refused:
        load(tmp_path, {"t": times})
    assert "--fs" not in str(refused.value)
    (caution,) = load(tmp_path, {"t": times}, fs_hz=20_480.0).cautions
    assert caution.endswith("read as even, at 20480 Hz")
    assert load(tmp_path, {"t": times, "fs": 20_480.0}).cautions == (caution,)


NOT_FINITE = "1 of the times of t are not finite numbers; read as even, at 20480 Hz"


@pytest.mark.parametrize(
    ("times", "fs_hz", "cautions"),
    [
        (GRID, 25_600.0, ("the times of t mean 20480 Hz, read at 25600 Hz",)),
        (GRID, 20_480.0, ()),
        (GRID * 1e3, 20_480.0, ()),
        (GRID * 1e3, 30_000.0, ("the times of t mean 20.48 Hz, read at 30000 Hz",)),
        (SAMPLE, 30_000.0, ()),
        (np.where(SAMPLE == 7, np.nan, GRID), 20_480.0, (NOT_FINITE,)),
    ],
)
def test_a_rate_against_the_times(tmp_path, times, fs_hz, cautions):
    """Stated by the file or by the user."""
    assert load(tmp_path, {"t": times, "fs": fs_hz}).cautions == cautions
    assert load(tmp_path, {"t": times}, fs_hz=fs_hz).cautions == cautions


def test_what_is_left_out_is_said(tmp_path):
    notes = load(tmp_path, {"fs": 8000.0, "short": np.arange(100.0), "no": np.arange(1, N + 1)}).notes
    assert "left out, no signal of 256 samples or more: short (100, 1), no (4096, 1)" in notes
    notes = load(tmp_path, {"fs": 8000.0, "y": files.vibration(300)}, channel="x").notes
    assert "left out, of another length, rate or unit: y" in notes
    (entry,) = add(tmp_path).recordings
    assert entry.channels == ("x", "y")
