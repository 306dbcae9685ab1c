"""Bias and scatter: the record is the unit, few records claim nothing, the data's scatter is not the model's."""

import numpy as np
import pytest

from srbval.bearing import Fault
from srbval.comparison.bias import LEAST_RECORDS, biases
from srbval.comparison.compared_quantities import HARMONIC, PRESENCE
from srbval.comparison.comparison import RIG_READING, QuantityValue, comparison_frame, comparison_row
from srbval.signal import NORMAL_95

# Three standard errors of mean and standard deviation of 4000 errors that scatter by 1.8; the data's is exact.
MEAN_DB, SCATTER_RELATIVE, DATA_RELATIVE = 0.1, 0.05, 1e-4


def row(error, record, data=1.0, kind=HARMONIC[2].kind, **changes):
    sides = {"model": QuantityValue(value=error), "rig": QuantityValue(value=0.0)}
    names = {"kind": kind, "quantity": "q", "unit": "dB", "error_unit": "dB", "record": str(record), "scene": "rig"}
    parts = {RIG_READING: NORMAL_95 * data}
    return comparison_row(state=Fault.INNER, error=error, parts=parts, **names | sides | changes)


def found_biases(rows, **options):
    return biases(comparison_frame(rows), **options)


@pytest.mark.parametrize(("bias", "scatter"), [(-2.0, 1.5), (0.0, 0.0)])
def test_scatter_of_the_data_is_not_the_model_s(bias, scatter):
    rng = np.random.default_rng(1)
    errors = bias + scatter * rng.standard_normal(4000) + rng.standard_normal(4000)
    (found,) = found_biases([row(error, i) for i, error in enumerate(errors)])
    assert found["bias"] == pytest.approx(bias, abs=MEAN_DB)
    assert found["scatter"] == pytest.approx(scatter, rel=SCATTER_RELATIVE, abs=0.3)
    assert found["data_scatter"] == pytest.approx(1.0, rel=DATA_RELATIVE)


def test_fewer_than_five_records_claim_nothing_however_many_numbers_they_hold():
    few = [row(1.0, record) for record in range(LEAST_RECORDS - 1) for _ in range(10)]
    (found,) = found_biases(few)
    assert (found["records"], found["bias"], found["ci95"], found["scatter"]) == (4, None, None, None)
    (found,) = found_biases([*few, row(1.0, "one more")])
    assert (found["records"], found["bias"]) == (5, 1.0)


def test_student_s_interval_over_records():
    """Five records: t(4) = 2.776 of Student's table."""
    (found,) = found_biases([row(e, i) for i, e in enumerate((1.0, 2.0, 3.0, 4.0, 5.0))])
    assert found["ci95"] == pytest.approx(2.776445 * np.std([1, 2, 3, 4, 5], ddof=1) / np.sqrt(5), rel=1e-6)


def test_rows_are_pooled_by_kind_scene_and_use_and_never_across():
    unseen = row(99.0, "c", rig=QuantityValue(value=0.0, present=False))
    few = [row(1.0, "a"), row(3.0, "a"), row(-4.0, "b"), unseen, row(1.0, "a", kind=PRESENCE.kind)]
    withheld, fit, paper, other = found_biases(
        [
            *few,
            row(8.0, "d", used_for="fit"),
            row(7.0, "a", scene="paper"),
            row(1.0, "a", kind=HARMONIC[3].kind),
        ]
    )
    assert (withheld["scene"], withheld["used_for"], withheld["records"], withheld["pairs"]) == (
        "rig",
        "withheld",
        2,
        3,
    )
    assert withheld["mean_error"] == pytest.approx(-1.0)  # of the records' means, 2 and -4
    assert (fit["used_for"], fit["mean_error"], paper["scene"], other["kind"]) == ("fit", 8.0, "paper", "harmonic 3")
    (pooled,) = found_biases([row(1.0, "a"), row(2.0, "b", used_for="blind")], used_for="withheld")
    assert (pooled["used_for"], pooled["records"]) == ("withheld", 2)
