import numpy as np
import pytest

from srbval.signal import phase_posterior
from srbval.signal.phase_posterior import CIRCLE, posterior

LINE_HZ, SECONDS, BLOCKS = 97.0, 10.0, 32
BLOCK_S = SECONDS / BLOCKS
NUMBER = np.array([1.0, 2.0])
# Steady lines of 25 in all: the posterior's mean within three of its own standard errors.
RECORDS = 40
# Six standard errors of the line's frequency (Cramer-Rao, 1.6 mHz).
SHIFT_HZ = 0.01
# The amplitudes are point estimates: the posterior may be wider or narrower than the walk's scatter by a third.
CREDIBLE = 0.35
# 40 intervals of 95 % once stretched: four binomial standard errors below.
STRETCH, LEAST_COVER = 1.3, 0.8
# The same sum in another order.
SUMMATION = 1e-9


def sums(rng, amplitude, *, shift_hz=0.0, jitter=0.0):
    """Block sums of a line `shift_hz` above where it was turned back, in units of their noise."""
    step = 2 * np.pi * jitter * np.sqrt(LINE_HZ * BLOCK_S)
    phase = 2 * np.pi * shift_hz * BLOCK_S * np.arange(BLOCKS) + np.cumsum(step * rng.standard_normal(BLOCKS))
    noise = (rng.standard_normal((NUMBER.size, BLOCKS)) + 1j * rng.standard_normal((NUMBER.size, BLOCKS))) / np.sqrt(2)
    return np.array(amplitude)[:, None] * np.exp(1j * (np.outer(NUMBER, phase) + 0.4)) + noise


def read(block_sums):
    return posterior(block_sums, NUMBER, line_hz=LINE_HZ, block_s=BLOCK_S)


@pytest.mark.parametrize("shift_hz", [0.07, -0.04])
def test_a_line_beside_its_place_is_found_on_its_own_side(shift_hz):
    told = read(sums(np.random.default_rng(1), (3.0, 1.5), shift_hz=shift_hz))
    assert told.shift_hz == pytest.approx(shift_hz, abs=SHIFT_HZ)
    assert abs(told.shift_hz - shift_hz) < told.credible_hz


def test_a_slipping_line_is_less_steady_and_less_certain():
    rng = np.random.default_rng(2)
    steady, slipping = (
        [read(sums(rng, (2.0, 1.0), jitter=jitter)) for _ in range(RECORDS // 2)] for jitter in (0.0, 0.01)
    )
    assert np.mean([told.steady for told in steady]) > 3 * np.mean([told.steady for told in slipping])
    assert np.median([told.credible_hz for told in slipping]) > 4 * np.median([told.credible_hz for told in steady])


def test_slip_is_covered_where_the_walk_hides_the_line():
    """Beginning and end of the walk are what the record tells of: a mean frequency is off by sqrt(walk / T) / 2 pi."""
    rng = np.random.default_rng(3)
    told = [read(sums(rng, (1.5, 0.8), jitter=0.008)) for _ in range(RECORDS)]
    expected = 1.96 * 0.008 * LINE_HZ / np.sqrt(LINE_HZ * SECONDS)
    assert np.median([t.credible_hz for t in told]) == pytest.approx(expected, rel=CREDIBLE)
    assert np.mean([abs(t.shift_hz) < STRETCH * t.credible_hz for t in told]) > LEAST_COVER


def test_recursion_is_the_sum_over_all_courses():
    """Three blocks, every course of the circle's points summed one by one."""
    rng = np.random.default_rng(4)
    amplitude, turn, step_rad2 = np.array([[1.2 + 0.3j, 0.5j]]), np.array([0.3]), np.array([0.2])
    seen = sums(rng, (1.2, 0.5))[:, :3]
    agreement = phase_posterior._block_likelihood(seen, NUMBER, amplitude)
    steps = phase_posterior._steps(step_rad2, turn)
    told = phase_posterior._forward(agreement, steps, np.zeros(1, dtype=np.int64))[0]
    circle = np.arange(CIRCLE) * 2 * np.pi / CIRCLE
    away = circle[:, None] - circle - turn[0] + 2 * np.pi * np.arange(-4, 5)[:, None, None]
    step = np.exp(-(away**2) / (2 * step_rad2[0])).sum(axis=0) * (2 * np.pi / CIRCLE) / np.sqrt(2 * np.pi * step_rad2)
    harmonics = np.conj(amplitude[0])[:, None] * np.exp(-1j * np.outer(NUMBER, circle))
    power = np.sum(np.abs(amplitude) ** 2)
    first, second, third = (np.exp(2 * (seen[:, b] @ harmonics).real - power) for b in range(3))
    whole = np.einsum("i,ji,j,kj,k->", first, step, second, step, third) / CIRCLE
    assert told == pytest.approx(np.log(whole), rel=SUMMATION)
