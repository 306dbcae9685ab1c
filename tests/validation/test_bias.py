import numpy as np
import pytest

from srbval.validation.bias import Pair, biases
from srbval.validation.compared_quantities import FREQUENCY, PATTERN


def drawn(kind, bias, scatter, data, count=4000):
    rng = np.random.default_rng(1)
    errors = bias + scatter * rng.standard_normal(count) + data * rng.standard_normal(count)
    return [
        Pair(kind=kind, name="", model=0.0, rig=0.0, error=float(e), data_ci95=1.96 * data, unit="dB") for e in errors
    ]


def test_scatter_of_the_data_is_not_the_model_s():
    (row,) = biases(drawn(PATTERN.name, bias=-2.0, scatter=1.5, data=1.0))
    assert row.bias == pytest.approx(-2.0, abs=0.1)
    assert row.scatter == pytest.approx(1.5, rel=0.05)
    assert row.data_scatter == pytest.approx(1.0, rel=1e-4)


def test_a_perfect_model_has_no_scatter_of_its_own_and_two_pairs_tell_none():
    (row,) = biases(drawn(FREQUENCY.name, bias=0.0, scatter=0.0, data=1.0))
    assert row.scatter < 0.3
    assert biases(drawn(FREQUENCY.name, bias=1.0, scatter=0.0, data=0.0, count=2))[0].scatter is None
    assert biases([]) == ()
