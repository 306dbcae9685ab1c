import numpy as np
import pytest

from srbval.signal import Periodogram, read_comb

FS_HZ, SECONDS, LINE_HZ, SHAFT_HZ = 2000.0, 10.0, 128.04, 71 / 6
TRIALS = 40
# 40 trials of a 95 % interval, four binomial standard errors below.
LEAST_COVER = 0.83
# The median of 40 intervals scatters by 1.4 %; noise in the sidebands' powers biases it besides.
MEDIAN_INTERVAL = 0.15
# Four sidebands of 0.16 of the line's power raise the information by a third: the bound falls by 13 %.
SHARPER = 0.95


def modulated(rng, depth=0.8):
    """Two harmonics of a line, modulated once a turn, in noise 22 dB below the first."""
    time_s = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
    gain = 1 + depth * np.cos(2 * np.pi * SHAFT_HZ * time_s + rng.uniform(0, 6.28))
    line = sum(np.cos(2 * np.pi * h * LINE_HZ * time_s + rng.uniform(0, 6.28)) for h in (1, 2))
    return 3 + gain * line + np.sqrt(time_s.size / 4 / 160) * rng.standard_normal(time_s.size)


def read(samples, sideband_hz):
    record = Periodogram.of(samples, FS_HZ, limit_hz=520.0, shaft_hz=SHAFT_HZ)
    return read_comb(record, LINE_HZ, 1.2, harmonics=2, sideband_hz=sideband_hz, shortest_block_s=2 / SHAFT_HZ)


def test_spacing_of_the_sidebands_is_the_shaft_speed_within_its_interval():
    rng = np.random.default_rng(1)
    readings = [read(modulated(rng), SHAFT_HZ + 0.003) for _ in range(TRIALS)]
    inside = [abs(r.sideband_hz - SHAFT_HZ) < r.sideband_ci95_hz for r in readings]
    assert np.mean(inside) > LEAST_COVER
    # Cramer-Rao of four sidebands, each 0.16 of a line of 160 times the noise.
    bound_hz = 1.96 * np.sqrt(6) / (2 * np.pi * SECONDS * np.sqrt(4 * 0.16 * 160))
    assert np.median([r.sideband_ci95_hz for r in readings]) == pytest.approx(bound_hz, rel=MEDIAN_INTERVAL)


def test_sidebands_sharpen_the_line():
    samples = modulated(np.random.default_rng(2))
    assert read(samples, SHAFT_HZ).noise_ci95_hz < SHARPER * read(samples, 0.0).noise_ci95_hz


def test_without_sidebands_there_is_no_spacing():
    assert read(modulated(np.random.default_rng(3), depth=0.0), SHAFT_HZ).sideband_hz is None
