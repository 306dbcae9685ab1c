"""Chances of false alarms: of noise in closed form, and the rank of a comb among meaningless ones."""

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.signal import Periodogram
from srbval.signal import false_alarm as alarm
from srbval.signal.comb import CombSpectrum, read_comb

BINS = 65
FIVE = np.eye(6)[5]  # all lines of the comb are seen in all of the window
# 200,000 draws at a tail of a few per mille: five standard errors.
DRAWS, TAIL_FACTOR = 200_000, 1.2
# Some 500 rises, whose number scatters a little more than a Poisson one.
RISES, RISE_SCATTER = 1500, 0.15


def test_neg_log_p_is_the_exact_tail_of_a_line_over_a_median_of_its_neighbours():
    rng = np.random.default_rng(1)
    mean = np.median(rng.exponential(size=(DRAWS, BINS)), axis=1) / np.log(2)
    ratio = rng.exponential(size=DRAWS) / mean
    for level in (2.0, 6.0):
        chance = np.exp(-alarm.neg_log_p(np.array([level]), np.array([BINS]))[0])
        assert 1 / TAIL_FACTOR < np.mean(ratio > level) / chance < TAIL_FACTOR
    # The mistake of taking the mean noise for known: at 12 times the noise twice too sure.
    assert np.exp(-alarm.neg_log_p(np.array([12.0]), np.array([BINS]))[0]) > 2 * np.exp(-12.0)


def test_comb_rises_as_often_as_a_count_of_drawn_spectra():
    """Spectra of noise alone, their true level known: the mean number of rises above a level in the window."""
    rng = np.random.default_rng(2)
    half_hz, seconds, level, harmonics = 0.5, 8.0, 6.0, 2
    sample_s = np.arange(-160, 160) * seconds / 320
    offset_hz = np.linspace(-half_hz, half_hz, 161)
    transforms = [np.exp(-2j * np.pi * number * np.outer(offset_hz, sample_s)) for number in range(1, harmonics + 1)]
    comb = np.zeros((RISES, offset_hz.size))
    for transform in transforms:
        noise = (rng.standard_normal((RISES, 320)) + 1j * rng.standard_normal((RISES, 320))) / np.sqrt(640)
        comb += np.abs(noise @ transform.T) ** 2
    rises = np.count_nonzero((comb[:, :-1] <= level) & (comb[:, 1:] > level))
    expected = alarm.upcrossings(level, level, harmonics, half_hz, seconds)
    assert rises / RISES == pytest.approx(expected, rel=RISE_SCATTER)


def test_a_zero_neg_log_p_is_a_certain_false_alarm_and_a_large_one_does_not_underflow():
    assert alarm.false_alarm(0.0, 0.0, FIVE, 1.0, 10.0) == 1.0
    assert 0.0 <= alarm.false_alarm(1e4, 1e4, FIVE, 1.0, 10.0) < 1e-300


FS_HZ, SECONDS, SHAFT_HZ, LIMIT_HZ = 2000.0, 4.0, 11.83, 520.0
HARMONICS, RELATIVE = 5, 0.01
TRUE_HZ = 88.7
# 240 combs of 60 records: ranks below a twentieth within three binomial standard errors, and a distance from the
# uniform distribution that 60 independent ones stay below in 19 of 20 cases (1.36 / sqrt(60)).
RECORDS, COMBS_EACH, HIGHEST_SHARE, HIGHEST_DISTANCE = 60, 4, 0.13, 0.175


def record_of(rng, *, other=0.0, line=0.0):
    """White noise, six lines at random frequencies that are no one's harmonics, and a comb at `TRUE_HZ`."""
    time_s = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
    samples = rng.standard_normal(time_s.size)
    for _ in range(6):
        samples += other * np.cos(2 * np.pi * rng.uniform(50, LIMIT_HZ) * time_s + rng.uniform(0, 6))
    for number in range(1, HARMONICS + 1):
        samples += line * np.cos(2 * np.pi * number * TRUE_HZ * time_s + rng.uniform(0, 6))
    return Periodogram.of(samples, FS_HZ, limit_hz=LIMIT_HZ, shaft_hz=SHAFT_HZ)


def pool(centre_hz):
    elsewhere = alarm.fundamentals(45.0, LIMIT_HZ / HARMONICS / (1 + RELATIVE), RELATIVE)
    return elsewhere[np.abs(elsewhere / centre_hz - 1) > 2 * RELATIVE]


def rank(record, centre_hz):
    return alarm.rank_among_placebos(record, centre_hz, RELATIVE * centre_hz, HARMONICS, pool(centre_hz))


def test_ranks_are_uniform_where_other_lines_make_noise_only_probabilities_small():
    rng = np.random.default_rng(3)
    rows = []
    for _ in range(RECORDS):
        record = record_of(rng, other=0.5)
        for centre_hz in rng.uniform(50, 100, COMBS_EACH):
            reading = read_comb(record, centre_hz, RELATIVE * centre_hz, period_s=None)
            rows.append((rank(record, centre_hz)[0], 1.0 if reading is None else reading.noise_false_alarm))
    placebo, noise = np.array(rows).T
    assert np.mean(noise < 0.001) > 0.1
    assert np.mean(placebo < 0.05) < HIGHEST_SHARE
    ordered = np.sort(placebo)
    assert np.max(np.abs(ordered - (np.arange(ordered.size) + 0.5) / ordered.size)) < HIGHEST_DISTANCE


def test_a_comb_is_no_rarer_than_one_in_the_windows_that_share_no_line():
    """The strongest comb of a record stands in one of so few windows, whichever that is."""
    record = record_of(np.random.default_rng(4), other=0.3, line=0.4)
    assert rank(record, TRUE_HZ * 1.003)[0] == 1 / (alarm.MIN_PLACEBOS + 1)
    windows = pool(TRUE_HZ).size / (2 * alarm.GRID_PER_HALF_WINDOW)
    mixed, whole = rank(record, TRUE_HZ)
    assert whole == pytest.approx(1 / (windows + 1))
    assert alarm.joint_false_alarm(0.0, mixed, whole) > 0.1 / (windows + 1)
    _, elsewhere = rank(record, 0.8 * TRUE_HZ)
    assert elsewhere >= 1.5 / (windows + 1)  # the comb at TRUE_HZ is stronger
    assert alarm.joint_false_alarm(0.5, 0.0, 0.0) == 0.5


COMB_S, LINE_HZ, COMB_SHAFT_HZ, COMB_LIMIT_HZ = 6.0, 61.7, 17.3, 600.0


def combs(samples: FloatArray) -> CombSpectrum:
    record = Periodogram.of(3 + samples, FS_HZ, limit_hz=COMB_LIMIT_HZ, shaft_hz=COMB_SHAFT_HZ)
    return CombSpectrum.of([[record]], 1.1 * COMB_SHAFT_HZ)


def noise(seed: int) -> FloatArray:
    return np.random.default_rng(seed).standard_normal(round(FS_HZ * COMB_S))


def lines(*amplitudes: float) -> FloatArray:
    time_s = np.arange(round(FS_HZ * COMB_S)) / FS_HZ
    return np.asarray(sum(a * np.cos(2 * np.pi * h * LINE_HZ * time_s + h) for h, a in enumerate(amplitudes, 1)))


def test_a_comb_is_found_with_its_depth_and_gone_without_its_lines():
    found = combs(noise(1) + lines(0.2, 0.2, 0.2, 0.2, 0.2))
    at, half_hz = found.highest(LINE_HZ * 1.004, RELATIVE * LINE_HZ), RELATIVE * LINE_HZ
    assert found.frequency_hz[at] == pytest.approx(LINE_HZ, rel=1e-3)
    assert found.depth[at] == pytest.approx(0.2 / 3, rel=0.15)
    assert found.score[at] > found.typical(RELATIVE) + 10
    rest = found.without(LINE_HZ * np.arange(1, 11), np.full(10, 0.1))
    assert rest.score[rest.highest(LINE_HZ, half_hz)] < found.typical(RELATIVE) + 2
    assert found.highest(COMB_LIMIT_HZ / 4, RELATIVE) is None, "its fifth line is out of reach"


def test_on_noise_no_comb_is_far_above_a_typical_one():
    """Excesses over a typical window have a mean near zero and rarely reach 5, where a comb is evidence."""
    records, places_hz = (combs(noise(seed)) for seed in range(12)), np.geomspace(25, 110, 25)
    excess = [r.score[r.highest(f, RELATIVE * f)] - r.typical(RELATIVE) for r in records for f in places_hz]
    assert abs(np.mean(excess)) < 0.5
    assert np.mean(np.array(excess) > 5) < 0.01
