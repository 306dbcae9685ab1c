"""Pulses of a tachometer become the speed over time, with an interval that holds, or a question."""

import numpy as np
import pytest

from srbval.errors import DataError
from srbval.recordings import RecordingSettings, SpeedSource, load_recording
from srbval.recordings import speed as speed_module
from srbval.recordings.speed import SCALE_CI95, pulse_times, speed_from_pulses, tachometer_speed

FS_HZ = 25600.0
SECONDS = 4.0
START_HZ, RISE_HZ_PER_S = 20.0, 2.5  # a ramp: 20 to 30 Hz
TIME = np.arange(round(SECONDS * FS_HZ)) / FS_HZ
TURNS = START_HZ * TIME + RISE_HZ_PER_S * TIME**2 / 2
MEAN_HZ = TURNS[-1] / TIME[-1]
# of the speed, at its two ends where the spline has one neighbour only: half a turn of the ramp is 2.5e-3
COURSE = 2e-3
SPREAD = 0.01  # ten whole waves, sampled 400 times each, and a sensor without noise
RAMP_HZ = 1e-3  # quarters of 1000 samples of a ramp of 1 Hz
COVERED = (176, 198)  # 200 intervals: 88 to 99 %


def pulses(per_rev, *, width=0.1):
    """A square signal, high for `width` of each pulse."""
    return np.where((TURNS * per_rev + 0.3) % 1 < width, 4.8, 0.2)


@pytest.mark.parametrize(("per_rev", "width"), [(1, 0.02), (60, 0.5), (2.5, 0.98)])
def test_a_ramp(per_rev, width):
    speed, signal, count = speed_from_pulses(pulses(per_rev, width=width), FS_HZ, per_rev)
    assert count == pytest.approx(per_rev * TURNS[-1], abs=1)
    at = np.arange(signal.values_hz.size) / signal.rate_hz
    assert at[-1] == pytest.approx(SECONDS, rel=1e-6)
    inside = (at > 0.1) & (at < SECONDS - 0.1)
    np.testing.assert_allclose(signal.values_hz[inside], (START_HZ + RISE_HZ_PER_S * at)[inside], rtol=COURSE)
    assert speed.source is SpeedSource.TACHOMETER
    assert abs(speed.value_hz - MEAN_HZ) <= speed.ci95_hz
    assert speed.drift_hz == pytest.approx(RISE_HZ_PER_S * SECONDS * 0.75, rel=0.05)  # quarters are that far apart


def test_the_interval_holds_under_noise():
    """Noise moves every edge that is not steep: a steady 25 Hz, one sine per turn, sampled at 2 kHz."""
    rng, inside, time = np.random.default_rng(1), 0, np.arange(8000) / 2000.0
    for _ in range(200):
        signal = np.sin(2 * np.pi * (25.0 * time + rng.uniform())) + rng.normal(0, 0.05, time.size)
        speed, *_ = speed_from_pulses(signal, 2000.0, 1.0)
        inside += abs(speed.value_hz - 25.0) <= speed.ci95_hz
    assert inside >= 180  # 95 % are 190; 994 of 1000 were counted, for the ends' share is generous


def without_one():
    signal = pulses(1.0)
    first = round(float(pulse_times(signal)[20]))
    signal[first - 5 : first + 300] = 0.2
    return signal


@pytest.mark.parametrize(
    ("signal", "said"),
    [
        (without_one(), r"1 of \d+ intervals between pulses .* pulses are missing"),
        (np.ones(1000), "constant signal"),
        (pulses(1.0)[:3000], r"pulses, .* revolutions; 4 are needed"),
    ],
)
def test_missing_pulses_and_none(signal, said):
    with pytest.raises(DataError, match=said):
        speed_from_pulses(signal, FS_HZ, 1.0)


def test_a_channel_beside_the_vibration(tmp_path):
    path, acc = tmp_path / "a.npz", np.random.default_rng(0).normal(0, 1, TIME.size)
    np.savez(path, fs=np.array(FS_HZ), acc_unit=np.array("g"), acc=acc, key=pulses(2.0))
    for given, said in (
        ({}, r"which of 2 channels: --channel acc \| key; .*no shaft speed: .*--tacho"),
        ({"tacho": "none"}, r"no channel 'none'; it has acc, key"),
        ({"tacho": "key"}, r"tachometer key: pulses per revolution of the shaft: --pulses-per-rev N"),
        (
            {"tacho": "key", "pulses_per_rev": 1, "rpm": 1500},
            r"shows 300\d\.?\d* rpm, stated are 1500: check --pulses-per-rev",
        ),
    ):
        with pytest.raises(DataError, match=said):
            load_recording(path, RecordingSettings(**given))
    found = load_recording(path, RecordingSettings(tacho="key", pulses_per_rev=2))
    assert (found.channel, found.unit, found.speed_signal is not None) == ("acc", "m/s2", True)
    assert found.speed.value_hz == pytest.approx(MEAN_HZ, rel=1e-3)
    assert any("speed from tachometer key, 200 pulses, 2 per revolution" in note for note in found.notes)
    assert load_recording(path, RecordingSettings(tacho="key", pulses_per_rev=2, rpm=1490)).speed == found.speed
    np.savez(path, fs=np.array(FS_HZ), acc_unit=np.array("g"), acc=acc, rpm=60 * (START_HZ + RISE_HZ_PER_S * TIME))
    found = load_recording(path, RecordingSettings(tacho="rpm"))  # a speed in place of pulses
    assert (found.channel, found.speed.value_hz) == ("acc", pytest.approx(MEAN_HZ, rel=1e-4))


def test_the_shaft_s_own_variation_is_no_error_of_the_record_s_mean():
    """A wave of half a per cent, well sampled: the mean of what was is known to the clocks alone."""
    wave = 14.3 * (1 + 0.005 * np.sin(2 * np.pi * 5 * np.arange(4096) / 2048))
    speed = tachometer_speed(wave)
    assert speed.spread_hz == pytest.approx(0.005 * 14.3 / np.sqrt(2), rel=SPREAD)
    assert speed.ci95_hz == pytest.approx(SCALE_CI95 * 14.3, rel=SPREAD)


@pytest.mark.parametrize("smoothed", [15, 45, 91])
def test_noise_of_a_smoothed_signal_is_an_error_of_the_mean(smoothed, monkeypatch):
    """Angles read at 640 Hz with errors of a thousandth of a turn; the speed is smoothed, by up to a revolution."""
    monkeypatch.setattr(speed_module, "SCALE_CI95", 0.0)
    rng, window, covered = np.random.default_rng(4), np.hanning(smoothed + 2)[1:-1], [0, 0]
    for _ in range(200):
        angle = 14.3 * np.arange(1280 + smoothed) / 640 + rng.normal(0, 1e-3, 1280 + smoothed)
        signal = np.convolve(np.diff(angle) * 640, window / window.sum(), "valid")
        for known, rate_hz in enumerate((None, 640.0)):
            speed = tachometer_speed(signal, rate_hz)
            covered[known] += abs(speed.value_hz - 14.3) < speed.ci95_hz
    assert covered[0] < COVERED[0] <= covered[1] <= COVERED[1]  # white noise alone explains too little


@pytest.mark.parametrize("direction", [1, -1])
def test_drift_and_direction(direction):
    speed = tachometer_speed(direction * np.linspace(10, 11, 1000))
    assert (speed.value_hz, speed.drift_hz) == (pytest.approx(10.5), pytest.approx(0.75, abs=RAMP_HZ))


@pytest.mark.parametrize("signal", [np.zeros(100), np.full(100, 1e5), np.ones(3)])
def test_what_is_no_shaft_speed(signal):
    with pytest.raises(DataError, match="speed signal"):
        tachometer_speed(signal)


@pytest.mark.parametrize("spike", [50.0, -50.0])
def test_a_spike_does_not_move_the_levels(spike):
    signal = pulses(1.0)
    edges = pulse_times(signal)
    signal[5000] = spike
    assert abs(pulse_times(signal).size - edges.size) <= 1
