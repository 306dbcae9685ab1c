"""Rows of the table of lines: coherent, and the probability that a found peak is the line."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.stats

from srbval.bearing import LARGEST_SLIP, Bearing, load_bearing
from srbval.reading import lines as line_reading
from srbval.reading.families import SLIP_FREEDOM, SLIP_SPREAD, identity_probability, window_share
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.signal import LEAST_SNR, LineReading, Periodogram, is_improbable
from srbval.signal.comb import FALSE_ALARM, PLACEBO_FALSE_ALARM

FS_HZ, LIMIT_HZ = 2000.0, 700.0
BEARINGS = ("skf-6205", "skf-22240", "uc-204", "rexnord-za-2115")
RECORDS = 26
EDGE = 1e-9  # of a window, as a share: rounding


def squared_envelope(rng: np.random.Generator, lines_hz: np.ndarray, heights: np.ndarray, seconds: float) -> np.ndarray:
    """Mean one, noise of a hundredth, and cosines of the given heights."""
    time_s = np.arange(round(seconds * FS_HZ)) / FS_HZ
    waves = heights @ np.cos(2 * np.pi * np.outer(lines_hz, time_s) + rng.uniform(0, 6.3, (lines_hz.size, 1)))
    return np.asarray(1 + waves + 0.1 * rng.standard_normal(time_s.size))


def periodogram(samples: np.ndarray, shaft_hz: float) -> Periodogram:
    return Periodogram.of(samples, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=shaft_hz)


def random_record(seed: int) -> tuple[Periodogram, Bearing, ShaftSpeed]:
    """A record of 2 to 10 s with lines of the bearing, of its shaft and of anything else, from weak to very strong."""
    rng = np.random.default_rng(seed)
    bearing = load_bearing(BEARINGS[rng.integers(len(BEARINGS))])
    shaft_hz, seconds = rng.uniform(6, 30), rng.uniform(2, 10)
    orders = rng.permutation([bearing.orders.bpfo, bearing.orders.bpfi, 2 * bearing.orders.bsf, bearing.orders.ftf])
    combs = [*orders[: rng.integers(0, 4)], *rng.uniform(0.3, 12, rng.integers(0, 3)), 1.0]
    fundamentals = [order * (1 + 0.004 * rng.standard_normal()) for order in combs[:-1]] + [1.0]
    hz = shaft_hz * np.concatenate([order * np.arange(1, 7) for order in fundamentals])
    heights = np.repeat(10 ** rng.uniform(-3, 0, len(fundamentals)), 6) * rng.uniform(0, 1, hz.size)
    speed = ShaftSpeed(value_hz=shaft_hz, ci95_hz=1e-4 * shaft_hz, source=SpeedSource.TACHOMETER)
    kept = hz < LIMIT_HZ
    return periodogram(squared_envelope(rng, hz[kept], heights[kept], seconds), shaft_hz), bearing, speed


def assert_coherent(line: line_reading.Line, window_hz: float) -> None:
    assert line.detected == (line.not_detected is None)
    snr, chance = line.snr or 0.0, 1.0 if line.noise_false_alarm is None else line.noise_false_alarm
    if line.detected:
        assert line.stands_out
        assert line.explained_by is None
        assert (line.placebo_false_alarm or 0) < PLACEBO_FALSE_ALARM
        assert "-" in line.name or "+" in line.name or abs(line.found_hz - line.kinematic_hz) <= window_hz * (1 + EDGE)
    elif line.found_hz is not None and line.explained_by is None:
        holds = {
            line_reading.NotDetected.WEAK: snr <= LEAST_SNR and not is_improbable(chance, line.placebo_false_alarm),
            line_reading.NotDetected.MULTIPLES: snr <= LEAST_SNR and chance < FALSE_ALARM,
            line_reading.NotDetected.NOISE: snr > LEAST_SNR and chance >= FALSE_ALARM,
            line_reading.NotDetected.MEANINGLESS: snr > LEAST_SNR
            and (line.placebo_false_alarm or 0) >= PLACEBO_FALSE_ALARM,
        }
        assert holds.get(line.not_detected), line
    if line.found_hz is not None:
        assert snr > 0, "a peak that was found has a height"


@pytest.mark.parametrize("trials", [1, 5])
def test_no_row_contradicts_itself(trials):
    reasons = set()
    for seed in range(RECORDS // trials):
        record, bearing, speed = random_record(seed)
        lines = line_reading.sidak_corrected(line_reading.read_lines(record, bearing, speed), trials)
        shown = {line.name for line in lines if line.is_first and line.detected}
        half = {x.name: max(window_share(bearing, speed) * x.kinematic_hz, record.bin_hz) for x in lines}
        for line in lines:
            assert_coherent(line, line.harmonic * half[line.name])
            own = line.name.replace("+", "-").split("-")[0]
            assert not line.detected or own in shown, "a harmonic or sideband without its line"
        reasons |= {line.not_detected for line in lines}
        text = line_reading.describe_lines(lines, speed)
        assert "weaker" not in text
        assert all(line.name in text for line in line_reading.detected_fault_lines(lines))
    seldom = {line_reading.NotDetected.OUT_OF_REACH, line_reading.NotDetected.NOISE}
    assert trials > 1 or reasons >= {*line_reading.NotDetected, None} - seldom


HALF, LINE_HZ = 0.01, 100.0


def probability(deviation: float, speed_ci95: float, chance: float) -> float:
    known = {"ci95_hz": 0.0, "snr": (20.0,), "isolated": True, "depth": 0.1, "resolution_hz": 0.1}
    known |= {"noise_false_alarm": chance, "half_window_hz": HALF * LINE_HZ}
    reading = LineReading(found_hz=LINE_HZ * (1 + deviation), **known)
    return identity_probability(reading, LINE_HZ, speed_ci95, LARGEST_SLIP)


def test_probability_is_the_share_of_lines_whatever_they_slip():
    """Lines by the prior, others anywhere, equally strong: of those called p a share p are lines, far off too."""
    rng, count = np.random.default_rng(3), 2000
    slips = SLIP_SPREAD * rng.standard_t(SLIP_FREEDOM, 2 * count)
    slips = slips[np.abs(slips) < HALF][:count]
    places = np.concatenate((slips, rng.uniform(-HALF, HALF, count)))
    is_line = np.arange(2 * count) < count
    called = np.array([probability(float(d), 0.0, 1.0) for d in places])
    of_line = scipy.stats.t(SLIP_FREEDOM, scale=SLIP_SPREAD)
    density = of_line.pdf(places) / (of_line.cdf(HALF) - of_line.cdf(-HALF))
    assert called == pytest.approx(density / (density + 0.5 / HALF))
    for low, high in ((0.0, 0.05), (0.05, 0.1), (0.1, 0.3), (0.3, 0.6), (0.6, 0.8), (0.8, 1.0)):
        group = (called >= low) & (called < high)
        scatter = 0.5 / np.sqrt(group.sum())
        assert np.mean(is_line[group]) == pytest.approx(np.mean(called[group]), abs=4 * scatter)


def test_further_off_or_weaker_is_less_probable_and_an_unsure_speed_says_less():
    near, far = (probability(d, 1e-4, 1e-4) for d in (0.001, 0.006))
    assert near > 0.99 > line_reading.LEAST_IDENTITY > probability(0.0095, 1e-4, 1e-4)
    assert near > far > probability(0.006, 1e-4, 1e-2)
    assert probability(0.0095, 2e-2, 1e-4) > 0.99
    assert probability(-0.006, 1e-4, 1e-4) == pytest.approx(far)
