"""The angle between envelope spectra: blind to gain and line frequency, told with an interval that holds."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.recordings.stand_in import vibration
from srbval.validation.analyse import analyse
from srbval.validation.pipeline import process
from srbval.validation.spectrum_shape import BINS, HARMONICS, Angle, angle_between, angle_within, halves
from tests.validation.test_shaft_speed import record

GAIN_DEGREES = 1e-3  # a gain falls out but for rounding

BEARING = load_bearing("skf-6205")
FS_HZ, SECONDS, SHAFT_HZ = 20480.0, 2.0, 25.0
REPEATS = 60
BAND_HZ = (1400.0, 2800.0)
# What 57 or fewer of 60 intervals of 95 % would hold with a chance of 0.35, 54 or fewer with one of 0.03.
LEAST_HELD = 54


def made(state, seed, *, gain=1.0, faster=1.0):
    turns = np.arange(int(FS_HZ * SECONDS)) * SHAFT_HZ * faster / FS_HZ
    samples = gain * vibration(state, BEARING.orders, turns, np.random.default_rng(seed))
    base = record(shaft_hz=SHAFT_HZ)
    return dataclasses.replace(
        base, channels={"x": samples}, channel="x", fs_hz=FS_HZ, state=state, band_hz=BAND_HZ,
        speed=dataclasses.replace(base.speed, value_hz=SHAFT_HZ * faster, ci95_hz=0.0), unit="m/s2",
    )  # fmt: skip


def analysed(state, seed, **changes):
    recording = made(state, seed, **changes)
    return analyse(recording, bearing=BEARING, speed=recording.speed)


def shape(state, seed, line="BPFI", **changes):
    analysis = analysed(state, seed, **changes)
    return halves(analysis, analysis.line(line).found_hz)


@pytest.fixture(scope="module")
def inner():
    return shape(Fault.INNER, 1)


def test_gain_and_speed_fall_out(inner):
    assert inner.shape == (2, HARMONICS * BINS)
    louder, faster = shape(Fault.INNER, 1, gain=100.0), shape(Fault.INNER, 1, faster=1.03)
    assert angle_between(inner, louder).degrees == pytest.approx(angle_between(inner, inner).degrees, abs=GAIN_DEGREES)
    assert angle_between(inner, faster).degrees < angle_within(inner).degrees + angle_within(inner).ci95


def test_another_fault_has_another_shape(inner):
    same, other = shape(Fault.INNER, 2), shape(Fault.OUTER, 3, line="BPFO")
    within, alike, unlike = angle_within(inner), angle_between(inner, same), angle_between(inner, other)
    assert abs(alike.degrees - within.degrees) < within.ci95
    assert unlike.degrees - alike.degrees > unlike.ci95 + alike.ci95


def test_intervals_hold_over_noise_and_slip():
    """Halves against each other, many records: their mean lies in the stated interval of 95 in 100 of them."""
    line_hz = BEARING.orders.bpfi * SHAFT_HZ
    records = (SimpleNamespace(processed=process(made(Fault.INNER, seed), band_hz=BAND_HZ)) for seed in range(REPEATS))
    angles = [angle_within(halves(record, line_hz)) for record in records]
    mean = np.mean([a.degrees for a in angles])
    assert sum(abs(a.degrees - mean) <= a.ci95 for a in angles) >= LEAST_HELD


def test_unrelated_spectra_are_told_as_unrelated():
    rng = np.random.default_rng(5)
    draws = [angle_between(*rng.standard_normal((2, 2, 120))) for _ in range(REPEATS)]
    assert sum(a.related for a in draws) <= 0.1 * REPEATS
    assert Angle(degrees=60.0, ci95=20.0).related


def test_fewer_harmonics_where_the_band_ends_and_none_where_the_record_is_too_short():
    analysis = analysed(Fault.INNER, 1)
    line = analysis.line("BPFI").found_hz
    narrow = dataclasses.replace(analysis, processed=dataclasses.replace(analysis.processed, band_hz=(1400.0, 1900.0)))
    assert halves(narrow, line).shape[1] == 2 * BINS
    short = dataclasses.replace(analysis.processed, squared=analysis.processed.squared[: 16 * BINS])
    assert halves(dataclasses.replace(analysis, processed=short), line) is None
    assert halves(analysis, 1e4) is None
