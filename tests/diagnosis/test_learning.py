"""Evidence learnt from readings of known state, and the simple rules that it is compared with."""

import dataclasses
import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from srbval.bearing import Fault
from srbval.diagnosis.fault_posterior import CLASSES, OTHER, PRIOR, evidence
from srbval.diagnosis.learning import evidence_toml, fit_evidence, weights
from srbval.diagnosis.plain_rules import by_excess, common_practice
from srbval.storage.tables import read_toml
from tests.reading.test_shaft_speed import BEARING, record

SLOPE_REL, ONSET_ABS, SHARE_ABS = 0.1, 0.5, 0.06  # of 400 readings of each class
TAIL = 0.7  # scale of healthy features


def row(state: str, features: Any, *, rig: str = "r", specimen: str = "s") -> dict[str, Any]:
    return {"rig": rig, "specimen": specimen, "state": state, "features": list(features)}


def test_the_fit_finds_the_tail_of_the_healthy_and_the_share_that_hides(tmp_path: Any) -> None:
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


def test_classes_rigs_and_bearings_weigh_the_same_whatever_their_number_of_readings() -> None:
    known = [row("outer", (), rig="a"), row("outer", (), rig="b"), row("outer", (), rig="b")]
    known += [row("outer", (), rig="b", specimen="t"), *[row(OTHER, ())] * 5]
    share = PRIOR["outer"]
    expected = [share / 2, share / 8, share / 8, share / 4, *[PRIOR[OTHER] / 5] * 5]
    np.testing.assert_allclose(weights(pd.DataFrame(known)), expected)


def test_the_highest_line_is_named_and_nothing_in_noise() -> None:
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
def test_the_rule_of_the_greatest_excess_asks_for_a_margin(views: list[tuple[float, ...]], part: Fault | None) -> None:
    assert by_excess(views) is part
