"""Files of no known data set: text, .npy, .mat and .h5, and what must be asked of the user."""

from pathlib import Path

import numpy as np
import pytest

from srbval.recordings import SpeedSource, load_recording

from . import files

TIME_DIGITS = 1e-6  # times written with six decimals
SAMPLE_DIGITS = 1e-8  # samples written with ten digits


def test_csv_with_time_column_and_settings(tmp_path: Path) -> None:
    table = np.stack([np.arange(1000) / 5000, files.vibration(1000)], axis=1)
    path = tmp_path / "record.csv"
    path.write_text("# unit = g\n# rpm = 1200\ntime_s,acc\n" + "\n".join(f"{t:.6f},{x:.9e}" for t, x in table))
    r = load_recording(path)
    assert (r.fs_hz, r.channel, r.unit) == (pytest.approx(5000, rel=TIME_DIGITS), "acc", "m/s2")
    np.testing.assert_allclose(r.channels["acc"], files.vibration(1000) * 9.80665, rtol=SAMPLE_DIGITS)
    assert (r.speed.source, r.speed.value_hz) == (SpeedSource.STATED, pytest.approx(20.0))


def test_matrix_columns_are_channels(tmp_path: Path) -> None:
    np.save(tmp_path / "m.npy", np.stack([files.vibration(seed=i) for i in range(3)]))
    r = load_recording(tmp_path / "m.npy", channel="data[3]", fs_hz=1000, unit="g")
    np.testing.assert_allclose(r.channels["data[3]"], files.vibration(seed=2) * 9.80665)
