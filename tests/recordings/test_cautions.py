"""What the samples themselves show to be wrong is said, with its count, wherever the file is shown."""

import numpy as np
import pytest
from scipy.io import savemat

from srbval.recordings import load_recording
from srbval.recordings.registry import add

from . import files


def cautions_of(tmp_path, samples):
    np.save(tmp_path / "x.npy", samples)
    return load_recording(tmp_path / "x.npy", fs_hz=8000.0, unit="g").cautions


def clipped(top=1.5):
    return np.clip(files.vibration(40_000), -9, top)


@pytest.mark.parametrize("scale", [1.0, 9.80665 / 2**15, 1e-3])
@pytest.mark.parametrize("bits", [12, 16, 24])
def test_limits_of_a_converter_are_clipping(tmp_path, bits, scale):
    """As integers or scaled: at either end of the range, even where no two in a row are clipped."""
    half = 2 ** (bits - 1)
    samples = np.round(files.vibration(20_000) * half / 9)
    samples[[100, 300, 500]], samples[700], samples[701] = half - 1, -half, 1
    top, bottom = cautions_of(tmp_path, samples * scale)
    assert "clipped: 3 of 20000 samples (0.015 %)" in top
    assert f"the limit of {bits} bits, up to 1 in a row" in top
    assert "clipped: 1 of 20000 samples" in bottom


def test_held_samples_and_zeros(tmp_path):
    samples = files.vibration(40_000)
    samples[1000:1020], samples[5000:5100] = samples[1000], 0.0
    held = "held, not measured: 120 of 40000 samples (0.3 %) in 2 run(s) of equal samples"
    assert cautions_of(tmp_path, samples) == (f"{held}, the longest 100 times 0 from sample 5000 on",)


@pytest.mark.parametrize(
    "samples",
    [
        files.vibration(40_000),
        np.round(files.vibration(200_000) * 0.5),  # into 5: repeats of a dozen samples are chance
        np.round(500 * np.sin(np.arange(40_000) / 700)),  # a slow sine's tops are flat by their digits alone
        np.repeat(files.vibration(10_000), 4),  # held evenly throughout: no single run says anything
        np.sin(2 * np.pi * np.arange(40_000) / 40),  # its peaks are exactly 1, a thousand times
        np.where(np.arange(4096) == 5, 1.0, 0.0) + files.vibration(),
    ],
)
def test_sound_samples_are_not_accused(tmp_path, samples):
    assert cautions_of(tmp_path, samples) == ()


def test_cautions_are_those_of_the_channel_analysed(tmp_path):
    savemat(tmp_path / "a.mat", {"good": files.vibration(40_000), "bad": clipped(), "fs": 8000.0})
    assert load_recording(tmp_path / "a.mat", channel="good", unit="g").cautions == ()
    (said,) = load_recording(tmp_path / "a.mat", channel="bad", unit="g").cautions
    (entry,) = add(tmp_path / "a.mat").recordings
    assert entry.cautions == (f"bad: {said}",)


def test_analyse_and_data_show_cautions(tmp_path, srbval_text, srbval_json):
    path = tmp_path / "a.mat"
    savemat(path, {"x": clipped(), "fs": 8000.0})
    options = ["--unit", "g", "--rpm", "1500", "--bearing", "skf-6205"]
    out = srbval_text("analyse", path, "--band", "500", "3000", *options).out
    assert out.index("caution: clipped: ") < out.index("every line, features, reasons")
    (said,) = srbval_json("analyse", path, "--band", "500", "3000", *options)["cautions"]
    assert f"a.mat: caution: {said}" in srbval_text("data", "add", path, *options).out
    (entry,) = srbval_json("data", "list")["recordings"]
    assert (entry["cautions"], entry["status"], entry["reason"]) == ([said], "ok", None)


def test_a_cautioned_healthy_baseline_is_said(tmp_path, srbval_text):
    """The fault call rests on it."""
    acceleration = files.vibration(40_000)
    common = {"time_acc": np.arange(40_000) / files.FS_HZ, "rpm_nominal": 353, "mean_rpm": 353.0}
    common |= {"rpm": 353 + 0.5 * files.vibration(1250, 1), "time_rpm": np.arange(1250) / 640}
    for state, samples in (("OR", acceleration), ("H", np.clip(acceleration, -9, 1.5))):
        files.excerpt(tmp_path / f"{state}_353rpm_x.mat", condition=state, acc_m_s2=samples, acc_g=samples, **common)
    add(tmp_path)
    shown = srbval_text("analyse", tmp_path / "OR_353rpm_x.mat")
    assert "caution: healthy baseline" in shown.err
    assert "H_353rpm_x.mat: clipped: " in shown.err
    assert "caution: " not in shown.out
