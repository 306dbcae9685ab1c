import numpy as np
import pytest

from srbval.validation.bias import Pair, biases
from srbval.validation.compared_quantities import FREQUENCY, PATTERN

# Three standard errors of mean and standard deviation of 4000 errors that scatter by 1.8; the data's is exact.
MEAN_DB, SCATTER_RELATIVE, DATA_RELATIVE = 0.1, 0.05, 1e-4


def drawn(kind, bias, scatter, data, count=4000):
    rng = np.random.default_rng(1)
    errors = bias + scatter * rng.standard_normal(count) + data * rng.standard_normal(count)
    return [
        Pair(kind=kind, name="", model=0.0, rig=0.0, error=float(e), data_ci95=1.96 * data, unit="dB") for e in errors
    ]


def test_scatter_of_the_data_is_not_the_model_s():
    (row,) = biases(drawn(PATTERN.name, bias=-2.0, scatter=1.5, data=1.0))
    assert row.bias == pytest.approx(-2.0, abs=MEAN_DB)
    assert row.scatter == pytest.approx(1.5, rel=SCATTER_RELATIVE)
    assert row.data_scatter == pytest.approx(1.0, rel=DATA_RELATIVE)


def test_a_perfect_model_has_no_scatter_of_its_own_and_two_pairs_tell_none():
    (row,) = biases(drawn(FREQUENCY.name, bias=0.0, scatter=0.0, data=1.0))
    assert row.scatter < 0.3
    assert biases(drawn(FREQUENCY.name, bias=1.0, scatter=0.0, data=0.0, count=2))[0].scatter is None
    assert biases([]) == ()
