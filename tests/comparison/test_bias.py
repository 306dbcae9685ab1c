from dataclasses import replace

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.bias import LEAST_RECORDS, Pair, biases, biases_of
from srbval.comparison.compared_quantities import CAGE_RATIO, HARMONIC, PRESENCE
from srbval.comparison.comparison import RIG_READING, Comparison, QuantityValue

# Three standard errors of mean and standard deviation of 4000 errors that scatter by 1.8; the data's is exact.
MEAN_DB, SCATTER_RELATIVE, DATA_RELATIVE = 0.1, 0.05, 1e-4
LEVEL = HARMONIC[2].name


def pair(error, record, kind=LEVEL, data=1.0):
    return Pair(
        kind=kind, record=str(record), name="", model=0.0, rig=0.0, error=float(error), data_ci95=1.96 * data, unit="dB"
    )


def drawn(kind, bias, scatter, data, count=4000):
    rng = np.random.default_rng(1)
    errors = bias + scatter * rng.standard_normal(count) + data * rng.standard_normal(count)
    return [pair(e, i, kind, data) for i, e in enumerate(errors)]


def test_scatter_of_the_data_is_not_the_model_s():
    (row,) = biases(drawn(LEVEL, bias=-2.0, scatter=1.5, data=1.0))
    assert row.bias == pytest.approx(-2.0, abs=MEAN_DB)
    assert row.scatter == pytest.approx(1.5, rel=SCATTER_RELATIVE)
    assert row.data_scatter == pytest.approx(1.0, rel=DATA_RELATIVE)


def test_a_perfect_model_has_no_scatter_of_its_own():
    (row,) = biases(drawn(CAGE_RATIO.name, bias=0.0, scatter=0.0, data=1.0))
    assert row.scatter < 0.3
    assert biases([]) == ()


def test_fewer_than_five_records_claim_nothing_however_many_numbers_they_hold():
    few = [pair(1.0, record) for record in range(LEAST_RECORDS - 1) for _ in range(10)]
    (row,) = biases(few)
    assert (row.records, row.bias, row.ci95, row.scatter) == (4, None, None, None)
    (row,) = biases([*few, pair(1.0, "one more")])
    assert (row.records, row.bias) == (5, 1.0)


def test_student_s_interval_over_records_holds_the_bias_as_often_as_it_says():
    """Five records: 2.776 s / sqrt(5); over 2000 sets the share that holds the truth is 95 % within three of its
    standard errors."""
    (row,) = biases([pair(e, i) for i, e in enumerate((1.0, 2.0, 3.0, 4.0, 5.0))])
    assert row.ci95 == pytest.approx(2.776445 * np.std([1, 2, 3, 4, 5], ddof=1) / np.sqrt(5), rel=1e-6)
    rng = np.random.default_rng(2)
    held = []
    for _ in range(2000):
        (row,) = biases([pair(e, i) for i, e in enumerate(0.7 + rng.standard_normal(6))])
        held.append(abs(row.bias - 0.7) < row.ci95)
    assert np.mean(held) == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 2000))


def test_each_harmonic_has_a_bias_of_its_own_and_yes_or_no_has_none():
    found = [pair(e, i, kind.name) for kind, e in ((HARMONIC[2], 1.0), (HARMONIC[3], -1.0)) for i in range(5)]
    rows = biases([*found, *(pair(-1.0, i, PRESENCE.name) for i in range(5))])
    assert {row.kind: row.bias for row in rows} == {"harmonic 2": 1.0, "harmonic 3": -1.0}


def test_comparisons_are_pooled_by_kind_scene_and_use_and_never_across():
    def row(error, record, **changes):
        given = {"scene": "rig", "used_for": "withheld", "parts": {RIG_READING: 1.96}} | changes
        return Comparison(
            kind="band level", fault=Fault.INNER, quantity="1000 Hz", unit="dB", error_unit="dB", record=record,
            model=QuantityValue(value=error), rig=QuantityValue(value=0.0), error=error, **given,
        )  # fmt: skip

    few = [row(1.0, "a"), row(3.0, "a"), row(-4.0, "b")]
    unseen = replace(row(99.0, "c"), rig=QuantityValue(value=0.0, present=False))
    withheld, fit, paper = biases_of([*few, unseen, row(8.0, "d", used_for="fit"), row(7.0, "a", scene="paper")])
    assert (withheld.kind, withheld.scene, withheld.used_for) == ("band level", "rig", "withheld")
    assert (withheld.records, withheld.pairs, withheld.bias) == (2, 3, None)  # two records: no claim
    assert withheld.mean_error == pytest.approx(-1.0)  # of the records' means, 2 and -4
    assert withheld.data_scatter == pytest.approx(1.0, rel=DATA_RELATIVE)
    assert (fit.used_for, fit.mean_error, paper.scene, paper.mean_error) == ("fit", 8.0, "paper", 7.0)
