"""The angle between envelope spectra: blind to gain and line frequency, told with an interval that holds."""

import dataclasses
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.comparison.compared_quantities import SHAPE, shape_angle
from srbval.comparison.comparison import QuantityValue
from srbval.comparison.effects import DefectEffects
from srbval.comparison.spectrum_shape import (
    BINS,
    HARMONICS,
    UNRELATED_DEG,
    angle_between,
    angle_within,
    halves_of,
    noise_about,
    with_noise,
)
from srbval.reading.lines import Line
from srbval.reading.pipeline import process
from tests.reading.test_shaft_speed import record
from tests.recordings.synthetic_record import vibration

GAIN_DEGREES = 1e-3  # a gain falls out but for rounding

BEARING = load_bearing("skf-6205")
FS_HZ, SECONDS, SHAFT_HZ = 20480.0, 2.0, 25.0
REPEATS = 60
OFF, SPREAD = 0.15, 0.07  # three standard errors of a bin's mean logarithm, 1.28 / sqrt(600); of its scatter, relative
BAND_HZ = (1400.0, 2800.0)
# 57 or fewer of 60 intervals of 95 % would hold with a chance of 0.35, 54 or fewer with one of 0.03.
LEAST_HELD = 54


def made(state, seed, *, gain=1.0, faster=1.0):
    turns = np.arange(int(FS_HZ * SECONDS)) * SHAFT_HZ * faster / FS_HZ
    samples = gain * vibration(state, BEARING.orders, turns, np.random.default_rng(seed))
    base = record(shaft_hz=SHAFT_HZ)
    return dataclasses.replace(
        base, channels={"x": samples}, channel="x", fs_hz=FS_HZ, state=state, band_hz=BAND_HZ,
        speed=dataclasses.replace(base.speed, value_hz=SHAFT_HZ * faster, ci95_hz=0.0), unit="m/s2",
    )  # fmt: skip


def halves_about(processed, line_hz):
    line = SimpleNamespace(found_hz=line_hz)
    return halves_of(SimpleNamespace(processed=processed, line_of=lambda _: line), Fault.INNER)


def shape(state, seed, *, faster=1.0, **changes):
    processed = process(made(state, seed, faster=faster, **changes), band_hz=BAND_HZ)
    return halves_about(processed, state.line_order(BEARING.orders) * SHAFT_HZ * faster)


@pytest.fixture(scope="module")
def inner():
    return shape(Fault.INNER, 1)


def test_gain_and_speed_fall_out(inner):
    assert inner.shape == (2, HARMONICS * BINS)
    louder, faster = shape(Fault.INNER, 1, gain=100.0), shape(Fault.INNER, 1, faster=1.03)
    assert angle_between(inner, louder)[0] == pytest.approx(angle_between(inner, inner)[0], abs=GAIN_DEGREES)
    assert angle_between(inner, faster)[0] < sum(angle_within(inner))


def test_another_fault_has_another_shape(inner):
    same, other = shape(Fault.INNER, 2), shape(Fault.OUTER, 3)
    within, ci95 = angle_within(inner)
    alike, unlike = angle_between(inner, same), angle_between(inner, other)
    assert abs(alike[0] - within) < ci95
    assert unlike[0] - alike[0] > unlike[1] + alike[1]


def test_intervals_hold_over_noise_and_slip():
    """Halves against each other, many records: their mean lies in the stated interval of 95 in 100 of them."""
    angles = [angle_within(shape(Fault.INNER, seed)) for seed in range(REPEATS)]
    mean = np.mean([degrees for degrees, _ in angles])
    assert sum(abs(degrees - mean) <= ci95 for degrees, ci95 in angles) >= LEAST_HELD


def test_unrelated_spectra_are_told_as_unrelated():
    rng = np.random.default_rng(5)
    draws = [angle_between(*rng.standard_normal((2, 2, 120))) for _ in range(REPEATS)]
    assert sum(degrees + ci95 < UNRELATED_DEG for degrees, ci95 in draws) <= 0.1 * REPEATS


def test_fewer_harmonics_where_the_band_ends_and_none_where_the_record_is_too_short():
    processed, line_hz = process(made(Fault.INNER, 1), band_hz=BAND_HZ), BEARING.orders.bpfi * SHAFT_HZ
    assert halves_about(dataclasses.replace(processed, band_hz=(1400.0, 1900.0)), line_hz).shape[1] == 2 * BINS
    assert halves_about(dataclasses.replace(processed, squared=processed.squared[: 16 * BINS]), line_hz) is None
    assert halves_about(processed, 1e4) is None
    assert halves_about(processed, None) is None


LINE = Line(name="BPFI", harmonic=1, kinematic_hz=40.0, found_hz=40.0, resolution_hz=1 / 8)
LEVELS = {40.0: 1.0, 54.0: 0.3, 80.0: 0.5, 120.0: 0.25, 160.0: 0.1, 200.0: 0.05}  # a line, its harmonics, a sideband


def squared(noise, rng, fs_hz=1000.0, seconds=8.0):
    """Halves of a squared envelope with known lines in white noise, and the first line's power over it."""
    t = np.arange(int(fs_hz * seconds)) / fs_hz
    signal = 9 + sum(a * np.cos(2 * np.pi * f * t) for f, a in LEVELS.items()) + noise * rng.standard_normal(t.size)
    processed = SimpleNamespace(squared=signal, squared_fs_hz=fs_hz, band_hz=(0.0, 500.0))
    return halves_about(processed, 40.0), t.size / 4 / noise**2 if noise else None


@pytest.mark.parametrize("noise", [0.2, 1.5])
def test_noise_put_on_a_clean_spectrum_is_that_of_a_noisy_record(noise):
    """Mean and scatter of every bin's logarithm, over many records, one way and the other."""
    rng = np.random.default_rng(6)
    clean, _ = squared(0.0, rng)
    noisy = [squared(noise, rng) for _ in range(300)]
    read = np.array([own for own, _ in noisy])
    made = np.array([with_noise(clean, *noise_about(replace(LINE, snr=noisy[0][1])), rng) for _ in read])
    read, made = (x - x[..., BINS // 2].mean() for x in (read, made))
    assert np.abs(read.mean(axis=(0, 1)) - made.mean(axis=(0, 1))).max() < OFF
    assert made.std(axis=(0, 1)).mean() == pytest.approx(read.std(axis=(0, 1)).mean(), rel=SPREAD)
    within = [np.mean([angle_within(own)[0] for own in x]) for x in (read, made)]
    assert within[0] == pytest.approx(within[1], rel=SPREAD)


def test_a_right_model_expects_an_angle_and_a_wrong_one_exceeds_it(inner):
    """Draws of the same impulse model stand for those of the inputs; the record is one more, or has another fault."""
    draws = tuple(shape(Fault.INNER, seed).tolist() for seed in range(10, 29))
    known = DefectEffects(
        defect="inner", quantities=(), draws=19, failed=0, refined=False, predicted=(), spectra=draws,
        spectrum=inner.tolist(),
    )  # fmt: skip
    model, found = QuantityValue(value=0.0, halves=inner), {}
    for name, own in (("right", shape(Fault.INNER, 3)), ("wrong", shape(Fault.OUTER, 3))):
        line = replace(LINE, snr=1e4, detected=True)
        rig = QuantityValue(value=angle_within(own)[0], ci95=1.0, line=line, halves=own)
        found[name] = shape_angle(SHAPE, model, rig, known)
    right, wrong = found.values()
    assert right["p"] > 0.05
    assert right["verdict_override"] == "undecided"
    assert abs(right["error"]) < math.hypot(*right["parts"].values())
    assert wrong["p"] == pytest.approx(1 / 20)
    assert wrong["error"] > sum(wrong["parts"].values())
    assert "p" not in shape_angle(SHAPE, model, rig)  # nothing is known of the inputs
