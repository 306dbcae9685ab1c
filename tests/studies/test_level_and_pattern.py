"""Level and pattern apart, by planted truths; the scatter between mountings from planted pairs of records."""

import numpy as np
import pytest

from srbval.studies.level_and_pattern import draws_covariance, level_and_pattern, mounting_scatter

BANDS, COMMON_DB, OWN_DB, TRIALS = 6, 6.0, 1.0, 400
COVARIANCE = COMMON_DB**2 * np.ones((BANDS, BANDS)) + OWN_DB**2 * np.eye(BANDS)


def test_a_common_level_and_a_pattern_are_told_apart() -> None:
    level = level_and_pattern([12.0] * BANDS, COVARIANCE)
    assert level.level == pytest.approx(12.0)
    assert level.u == pytest.approx(np.sqrt(COMMON_DB**2 + OWN_DB**2 / BANDS))
    assert level.level_p == pytest.approx(0.047, abs=0.002)  # two of its deviations
    assert level.d2 == pytest.approx(0.0, abs=1e-9)
    pattern = level_and_pattern([3.0, -3.0] * 3, COVARIANCE)
    assert pattern.level == pytest.approx(0.0)
    assert pattern.d2 == pytest.approx(6 * 9 / OWN_DB**2)
    assert pattern.pattern_p < 1e-6, "hidden by the inputs' common level where each band is tested alone"
    assert level_and_pattern([-12.0], [[36.0]]).level == pytest.approx(-12.0)


def test_right_models_are_rejected_as_often_as_they_may_be() -> None:
    random = np.random.default_rng(1)
    found = [
        level_and_pattern(one, COVARIANCE) for one in random.multivariate_normal(np.zeros(BANDS), COVARIANCE, TRIALS)
    ]
    for p in (np.array([one.level_p for one in found]), np.array([one.pattern_p for one in found])):
        assert 0.02 < np.mean(p < 0.05) < 0.09  # three deviations of as many trials


def test_the_covariance_is_that_of_the_draws_and_of_each_band() -> None:
    random = np.random.default_rng(2)
    draws = random.multivariate_normal(np.zeros(BANDS), COVARIANCE - OWN_DB**2 * np.eye(BANDS), 4000)
    assert draws_covariance(draws, np.full(BANDS, OWN_DB)) == pytest.approx(COVARIANCE, rel=0.1)


@pytest.mark.parametrize("scatter", [0.7, 2.0, 3.0])
def test_the_scatter_between_mountings_is_found_where_faults_add_nothing(scatter: float) -> None:
    inside, means = [], []
    for seed in range(100):
        random = np.random.default_rng(seed)
        healthy, faulty = (scatter * random.standard_normal(60) for _ in range(2))
        off = faulty - healthy + np.where(np.arange(60) % 2, 30.0, 0.0) + 0.3 * random.standard_normal(60)
        quieter = off[off < 0]
        mean, low, high = mounting_scatter(quieter, np.full(quieter.size, 0.3), 2.0)
        inside.append(low <= scatter <= high)
        means.append(mean)
    assert np.mean(means) == pytest.approx(scatter, rel=0.15)
    assert np.mean(inside) > 0.88  # 95 %; three deviations of as many trials


def test_without_a_quieter_band_the_prior_remains() -> None:
    assert mounting_scatter([], [], 2.0)[0] == pytest.approx(2.0 * np.sqrt(2 / np.pi), rel=0.01)
