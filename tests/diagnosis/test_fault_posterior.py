"""Posterior probabilities of classes from what a record shows; evidence learnt from readings, and simple rules."""

import dataclasses
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from srbval.bearing import Fault
from srbval.diagnosis.fault_posterior import (
    CLASSES,
    OTHER,
    PRIOR,
    SHARED,
    UNDECIDED,
    Evidence,
    decide,
    evidence,
    of_one_machine,
)
from srbval.diagnosis.learning import evidence_toml, fit_evidence, weights
from srbval.diagnosis.plain_rules import by_excess, common_practice
from srbval.storage.tables import read_toml
from tests.reading.test_shaft_speed import BEARING, record

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
def test_clear_records_are_called(features, state):
    shares = said(features)
    assert sum(shares.values()) == pytest.approx(1)
    assert decide(shares) == state


def test_the_log_likelihood_is_the_equation_s():
    """log(h + (1 - h) exp(slope x - onset)); far up it rises by the slope, far down it is the share that hides."""
    by = dataclasses.replace(BY, slope=2.0, onset=3.0, hidden=0.25, roller_hidden=0.5)
    found = by.log_likelihood(np.array([1.5, 11.5, 1.5, -50.0]))
    beside = np.log(0.9 + 0.1 * 0.25)  # something else may be there too, and hides
    assert found["outer"] == pytest.approx(np.log(0.25 + 0.75) + beside)
    assert found["inner"] == pytest.approx(20 + np.log(0.75) + beside, abs=1e-6)
    assert (found["roller"], found[OTHER]) == pytest.approx((beside, np.log(0.25)))


def test_no_probability_is_above_what_so_many_bearings_can_show():
    sure = said((30.0, -1, -1, 1.0), by=dataclasses.replace(BY, specimens=dict(BY.specimens) | {"outer": 2}))
    assert sure["outer"] == pytest.approx(2.5 / 3)
    assert sum(sure.values()) == pytest.approx(1)


def test_a_class_shown_by_one_of_several_channels_is_called_and_the_others_are_paid_for():
    shown, silent = (14.0, -1, -1, 0.5), (-1.0, -1, -1, 0.5)
    alone, several = (BY.log_likelihood(*map(np.array, views)) for views in ((shown,), (shown, silent, silent)))
    assert several["outer"] == pytest.approx(alone["outer"] - np.log(3), abs=0.01)
    assert decide(said(silent, shown, silent)) == "outer"
    assert said(silent, silent, silent) == pytest.approx(said(silent))


def test_a_part_that_mostly_hides_is_not_excluded_by_silence():
    found = said((-1.0, -1, -1, 0.5))
    assert found["roller"] > 4 * found["outer"]


def test_records_of_one_machine_say_more_than_one_and_less_than_as_many():
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


SLOPE_REL, ONSET_ABS, SHARE_ABS = 0.1, 0.5, 0.06  # of 400 readings of each class
TAIL = 0.7  # scale of healthy features


def row(state: str, features: Any, *, rig: str = "r", specimen: str = "s") -> dict[str, Any]:
    return {"rig": rig, "specimen": specimen, "state": state, "features": list(features)}


def test_the_fit_finds_the_tail_of_the_healthy_and_the_share_that_hides(tmp_path):
    """Healthy features have an exponential tail; a third of the faults hide, the others spread to 20."""
    rng, known = np.random.default_rng(1), []
    for state in CLASSES:
        for number in range(400):
            values = rng.exponential(TAIL, 4) - 1
            if state != CLASSES[0] and rng.random() > 1 / 3:
                values[CLASSES.index(state) - 1] = rng.uniform(0, 20)
            known.append(row(state, values, specimen=str(number)))
    found = fit_evidence(pd.DataFrame(known))
    assert found.slope == pytest.approx(1 / TAIL, rel=SLOPE_REL)
    # The densities at x: exp(-(x + 1) / TAIL) / TAIL and 1 / 20.
    assert found.onset == pytest.approx(math.log(20 / TAIL) - 1 / TAIL, abs=ONSET_ABS)
    assert (found.hidden, found.roller_hidden) == pytest.approx((1 / 3, 1 / 3), abs=SHARE_ABS)
    (tmp_path / "e.toml").write_text(evidence_toml(found))
    read = read_toml(tmp_path / "e.toml")
    assert read["slope"] == pytest.approx(found.slope, rel=1e-2)
    assert read.keys() == {field.name for field in dataclasses.fields(evidence())}


def test_classes_rigs_and_bearings_weigh_the_same_whatever_their_number_of_readings():
    known = [row("outer", (), rig="a"), row("outer", (), rig="b"), row("outer", (), rig="b")]
    known += [row("outer", (), rig="b", specimen="t"), *[row(OTHER, ())] * 5]
    share = PRIOR["outer"]
    expected = [share / 2, share / 8, share / 8, share / 4, *[PRIOR[OTHER] / 5] * 5]
    np.testing.assert_allclose(weights(pd.DataFrame(known)), expected)


def test_the_highest_line_is_named_and_nothing_in_noise():
    called = common_practice(record(shaft_hz=25.0), BEARING)
    assert (called["fixed band"], called["kurtogram"], called["best of 8 bands"]) == (Fault.INNER,) * 3
    noise = record(shaft_hz=25.0, fault=False)
    silent = dataclasses.replace(noise, channels={"x": np.random.default_rng(3).standard_normal(noise.samples)})
    assert common_practice(silent, BEARING)["fixed band"] is None


@pytest.mark.parametrize(
    ("views", "part"),
    [
        ([(9, 2, 1)], Fault.OUTER),
        ([(1, 1, 1), (2, 1, 11)], Fault.ROLLER),
        ([(7.9, 1, 1)], None),
        ([(20, 17.5, 1)], None),
        ([(-1, 8, -1)], Fault.INNER),
    ],
)
def test_the_rule_of_the_greatest_excess_asks_for_a_margin(views, part):
    assert by_excess(views) is part
