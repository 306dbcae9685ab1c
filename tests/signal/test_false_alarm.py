import math

import numpy as np
import pytest
import scipy.stats

from srbval.signal import Periodogram, read_comb
from srbval.signal.false_alarm import comb_trials, evidence, false_alarm

RECORDS = 800
# 800 records at a nominal 10 %: three binomial standard errors are a factor 1.3; the rest is the estimate of
# the noise by a median. The comb's own approximation errs to the safe side.
SINGLE_FACTOR = 1.6
COMB_LOWEST, COMB_HIGHEST = 0.4, 1.3


def test_single_line_against_known_neighbours_has_the_closed_form():
    snr, bins, trials = 12.0, 20.0, 7.0
    total = float(evidence(np.array([snr]), np.array([bins]))[0])
    expected = 1 - (1 - (1 + snr / bins) ** -bins) ** trials
    assert false_alarm(total, 1, trials) == pytest.approx(expected, rel=1e-9)


def test_comb_is_the_gamma_tail_times_the_places_searched():
    tail = scipy.stats.gamma.sf(25.0, 5)
    assert false_alarm(25.0, 5, 100.0) == pytest.approx(1 - (1 - tail) ** 100, rel=1e-9)


def test_no_evidence_is_a_certain_false_alarm_and_strong_evidence_does_not_underflow_to_nonsense():
    assert false_alarm(0.0, 5, 10.0) == 1.0
    assert 0.0 <= false_alarm(1e4, 5, 10.0) < 1e-300


def test_places_searched_grow_with_window_duration_and_harmonics():
    assert comb_trials(1.0, 10.0, 1) == 40.0
    assert comb_trials(1.0, 10.0, 5) == pytest.approx(40 * math.sqrt(11))
    assert comb_trials(1e-6, 1.0, 1) == 1.0


def test_noise_alone_raises_false_alarms_at_the_nominal_rate():
    rng = np.random.default_rng(20)
    single, comb = [], []
    for _ in range(RECORDS):
        noise = 1 + rng.standard_normal(4000)
        record = Periodogram.of(noise, 2000.0, limit_hz=520.0, shaft_hz=11.83)
        for kept, harmonics in ((single, 1), (comb, 5)):
            reading = read_comb(record, 97.0, 0.97, harmonics=harmonics)
            kept.append(1.0 if reading is None else reading.false_alarm)
    rate_single, rate_comb = (np.mean(np.array(p) < 0.1) / 0.1 for p in (single, comb))
    assert 1 / SINGLE_FACTOR < rate_single < SINGLE_FACTOR
    assert COMB_LOWEST < rate_comb < COMB_HIGHEST
