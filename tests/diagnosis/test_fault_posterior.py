"""Posterior probabilities of classes from what a record shows."""

import dataclasses

import numpy as np
import pytest

from srbval.diagnosis.fault_posterior import (
    CLASSES,
    OTHER,
    SHARED,
    UNDECIDED,
    Evidence,
    decide,
    evidence,
    of_one_machine,
)

BY = evidence()


def said(*views: tuple[float, ...], by: Evidence = BY) -> dict[str, float]:
    return by.probabilities(by.log_likelihood(*map(np.array, views)))


@pytest.mark.parametrize(
    ("features", "state"),
    [
        ((12, -1, -1, 1.5), "outer"),
        ((-1, 11, -1, 1.5), "inner"),
        ((-1, -1, 9, 1.5), "roller"),
        ((0, 0, 0, 1.5), "healthy"),
        ((0, 0, 0, 9), OTHER),
        ((4.5, -1, -1, 0), UNDECIDED),
    ],
)
def test_clear_records_are_called(features: tuple[float, ...], state: str) -> None:
    shares = said(features)
    assert sum(shares.values()) == pytest.approx(1)
    assert decide(shares) == state


def test_the_log_likelihood_is_the_equation_s() -> None:
    """log(h + (1 - h) exp(slope x - onset)); far up it rises by the slope, far down it is the share that hides."""
    by = dataclasses.replace(BY, slope=2.0, onset=3.0, hidden=0.25, roller_hidden=0.5)
    found = by.log_likelihood(np.array([1.5, 11.5, 1.5, -50.0]))
    beside = np.log(0.9 + 0.1 * 0.25)  # something else may be there too, and hides
    assert found["outer"] == pytest.approx(np.log(0.25 + 0.75) + beside)
    assert found["inner"] == pytest.approx(20 + np.log(0.75) + beside, abs=1e-6)
    assert (found["roller"], found[OTHER]) == pytest.approx((beside, np.log(0.25)))


def test_no_probability_is_above_what_so_many_bearings_can_show() -> None:
    sure = said((30.0, -1, -1, 1.0), by=dataclasses.replace(BY, specimens=dict(BY.specimens) | {"outer": 2}))
    assert sure["outer"] == pytest.approx(2.5 / 3)
    assert sum(sure.values()) == pytest.approx(1)


def test_a_class_shown_by_one_of_several_channels_is_called_and_the_others_are_paid_for() -> None:
    shown, silent = (14.0, -1, -1, 0.5), (-1.0, -1, -1, 0.5)
    alone, several = (BY.log_likelihood(*map(np.array, views)) for views in ((shown,), (shown, silent, silent)))
    assert several["outer"] == pytest.approx(alone["outer"] - np.log(3), abs=0.01)
    assert decide(said(silent, shown, silent)) == "outer"
    assert said(silent, silent, silent) == pytest.approx(said(silent))


def test_a_part_that_mostly_hides_is_not_excluded_by_silence() -> None:
    found = said((-1.0, -1, -1, 0.5))
    assert found["roller"] > 4 * found["outer"]


def test_records_of_one_machine_say_more_than_one_and_less_than_as_many() -> None:
    """Faint signs of one fault in four records name it; one record's are its own, and many are worth two at most."""
    faint = BY.log_likelihood(np.array([-1.0, 4.8, -1, 0.5]))
    assert decide(BY.probabilities(faint)) == UNDECIDED
    assert of_one_machine([faint]) == faint
    four, many = of_one_machine([faint] * 4), of_one_machine([faint] * 1000)
    assert decide(BY.probabilities(four)) == "inner"
    for name in CLASSES[1:]:
        assert four[name] == pytest.approx(4 / (1 + 3 * SHARED) * faint[name])
        assert abs(many[name]) <= abs(faint[name]) / SHARED
    silent = BY.log_likelihood(np.array([-1.0, -1, -1, 0.5]))
    assert BY.probabilities(of_one_machine([silent] * 9))["healthy"] > BY.probabilities(silent)["healthy"]
