"""Power of the verdicts: what is planted is what is found, and how often, on few rigs and in the stored result."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from srbval.comparison.budget import TOLERANCE
from srbval.comparison.verdicts import Endpoint
from srbval.storage.stored_result import newest_result
from srbval.studies.verdict_power.study import PLANTED_PCT, RIGS, attainable, rates, read_again, true_ratios
from tests.comparison.test_verdicts import NAMES, readings, variant

FEW = 40
SAMPLED = 3.0  # standard deviations by which a stored share may differ from a rate by chance


def test_readings_scatter_about_the_truth_as_they_say() -> None:
    own, rng = readings(), np.random.default_rng(1)
    truth = true_ratios(variant(0.3), own)[:, 20]
    read = np.array([[one.ratio for one in read_again(own, truth, rng, between_pct=0.1)] for _ in range(300)])
    assert read.mean(axis=0) == pytest.approx(truth, rel=3e-4)
    assert read.std(axis=0) / truth == pytest.approx(1e-3, rel=0.2)


def test_the_larger_an_error_the_more_often_it_is_found() -> None:
    rows = list(rates(variant(), readings(), rigs=FEW))
    assert [(row["endpoint"], row["planted_pct"]) for row in rows] == [(n, p) for n in NAMES for p in PLANTED_PCT]
    for name in NAMES:
        none, _, margin, twice = (row for row in rows if row["endpoint"] == name)
        assert none["met"] > none["missed"]
        assert none["missed"] <= margin["missed"] < twice["missed"]
        for row in (none, margin, twice):
            assert row["met"] + row["missed"] + row["not_resolved"] == pytest.approx(1)


def test_nobody_finds_more_than_with_the_scatter_known() -> None:
    """By hand, of one endpoint: four records of 0.05 % at a power of Phi(0.1 / 0.025 - 1.645)."""
    own = [replace(one, reading_u=0.0, speed_u=0.0, per_speed=0.0) for one in readings()]
    level = Endpoint(name="level", weights=np.array([0.25] * 4 + [0.0] * (len(own) - 4)), rig=np.zeros(1))
    truth = np.full((len(own), 3), 0.43)
    assert attainable(level, truth, own, 0.2) == pytest.approx(0.9907, abs=1e-4)
    assert attainable(level, truth, own, TOLERANCE.limit_pct) is None


@pytest.fixture(scope="module")
def stored() -> list[dict[str, Any]]:
    kept = newest_result("verdict_power")
    if kept is None:
        pytest.skip("no stored result; srbval study run verdict_power makes one")
    rows: list[dict[str, Any]] = kept.content["rows"]
    return rows


def test_wrong_answers_are_as_rare_as_the_rule_says(stored: list[dict[str, Any]]) -> None:
    """With the error at the limit; below it "missed" is rarer still, above it "met"."""
    most = TOLERANCE.risk + SAMPLED * (TOLERANCE.risk * (1 - TOLERANCE.risk) / RIGS) ** 0.5
    for row in stored:
        assert row["rigs"] == RIGS
        assert row["planted_pct"] > TOLERANCE.limit_pct or row["missed"] <= most
        assert row["planted_pct"] < TOLERANCE.limit_pct or row["met"] <= most
