import numpy as np
import pytest

from srbval.studies.emulator import fit_emulator

POINTS = np.random.default_rng(1).random((40, 3))


def bent(points):
    return 2 + np.sin(5 * points[:, 0]) + points[:, 1] ** 2


def test_it_predicts_a_smooth_function_and_knows_the_input_that_does_nothing():
    emulator = fit_emulator(POINTS, bent(POINTS))
    new = np.random.default_rng(2).random((200, 3))
    assert np.sqrt(np.mean((emulator(new) - bent(new)) ** 2)) < 0.05 * np.std(bent(new))
    assert emulator.lengths[2] > 3 * emulator.lengths[0]


def test_noise_stays_in_the_residuals():
    """Runs that scatter by 0.3 whatever the inputs: what is left out is missed by that, and z is standard normal."""
    noisy = bent(POINTS) + 0.3 * np.random.default_rng(3).standard_normal(40)
    emulator = fit_emulator(POINTS, noisy)
    assert np.sqrt(np.mean(emulator.residuals**2)) == pytest.approx(0.35, abs=0.12)
    assert np.std(emulator.z) == pytest.approx(1, abs=0.3)
    assert emulator.outside < 0.15


def test_groups_have_noises_of_their_own():
    """One half of the runs scatters by 0.5, the other by nothing: both are told."""
    rng = np.random.default_rng(5)
    points, groups = rng.random((80, 3)), np.arange(80) % 2
    emulator = fit_emulator(points, bent(points) + 0.5 * groups * rng.standard_normal(80), groups)
    quiet, loud = (np.sqrt(np.mean(emulator.residuals[groups == one] ** 2)) for one in (0, 1))
    assert quiet < 0.1 < 0.4 < loud
    assert np.std(emulator.z[groups == 1]) == pytest.approx(1, abs=0.3)
    alike = fit_emulator(points, emulator.points @ [1.0, 0, 0] + 0.5 * groups * rng.standard_normal(80))
    assert np.std(alike.z[groups == 0]) < 0.6 * np.std(alike.z[groups == 1])  # which one noise for all does not tell
