"""The verdict by record: its distribution, its rules, and its error rates on vectors drawn from its own assumptions."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from srbval.bearing import Fault
from srbval.comparison.compared_quantities import CAGE_RATIO, HARMONIC
from srbval.comparison.comparison import MODEL_STARTS, RIG_READING, Comparison, ComparisonVerdict, QuantityValue
from srbval.comparison.effects import INPUTS, DefectEffects, QuantityEffects
from srbval.comparison.record_verdict import TRIALS, covariance, holm, record_verdict, tail

QUANTILE = 1e-4  # 1.96 for 1.95996
CHANCE = 3 / np.sqrt(TRIALS)  # three standard deviations of a share of the draws, at most


def quantity(name, deviation, unit="dB"):
    return QuantityEffects(
        name=name, unit=unit, value=1.0, shift=0.0, deviation=deviation, shares={}, grid_ci95=0.0, paper_points=None,
        paper_points_ci95=None, start_sd=0.0, paper_start_sd=None, outside=0.05,
    )  # fmt: skip


CORRELATION = [[1.0, 0.2, 0.3], [0.2, 1.0, 0.9], [0.3, 0.9, 1.0]]
DEVIATIONS = np.array([1e-4, 0.5, 1.0])
VALUES = 1.0 + DEVIATIONS * (
    np.random.default_rng(7).standard_normal((4000, 3)) @ np.linalg.cholesky(np.array(CORRELATION)).T
)
EFFECTS = DefectEffects(
    defect="outer", quantities=(quantity("cage ratio", 1e-4, "1"), quantity("2xBPFO", 0.5), quantity("3xBPFO", 1.0)),
    draws=4000, failed=0, refined=False, predicted=VALUES.tolist(),
)  # fmt: skip


RIG = 0.5  # of the cage ratio: a per cent of it is 0.005


def row(name, error, inputs, data=0.5, first=0.3, **sides):
    kind = CAGE_RATIO if name == "cage ratio" else HARMONIC[int(name[0])]
    values = {"model": QuantityValue(value=error), "rig": QuantityValue(value=RIG, ci95=data, first_ci95=first)}
    return Comparison(
        kind=kind.kind, state=Fault.OUTER, quantity=name, unit="dB", error_unit=kind.error_unit, record="made",
        error=error, parts={RIG_READING: data, MODEL_STARTS: 0.0, INPUTS: 1.96 * inputs}, margin=kind.margin,
        **(values | sides),
    )  # fmt: skip


def rows(cage=0.0, second=0.0, third=0.0):
    return [row("cage ratio", cage, 0.02, data=0.01, first=0.0), row("2xBPFO", second, 0.5), row("3xBPFO", third, 1.0)]


def test_levels_share_the_first_harmonic():
    own = covariance(rows())
    assert own[1, 2] == pytest.approx((0.3 / 1.96) ** 2, rel=QUANTILE)
    assert own[0, 1] == 0.0  # the cage has no part in the first harmonic
    assert own[1, 1] == pytest.approx((0.5 / 1.96) ** 2, rel=QUANTILE)


NOTHING = np.zeros((1, 2))


def test_without_a_mounting_it_is_chi_squared_and_with_one_its_mixture():
    own = np.array([[1.0, 0.6], [0.6, 2.0]])
    error = np.array([1.5, -1.0])
    d2, p = tail(error, own, np.ones(2), inputs=NOTHING)
    assert d2 == pytest.approx(error @ np.linalg.inv(own) @ error)
    assert p == pytest.approx(chi2.sf(d2, 2), abs=CHANCE)
    small = 0.01 * own
    d2, p = tail(np.array([5.0, 3.0]), small, np.ones(2), inputs=NOTHING, mounting=2.0)
    drawn = np.random.default_rng(9).standard_normal((5, 400_000))
    errors = 2 * drawn[0] * drawn[1:3] + 0.1 * (np.linalg.cholesky(own) @ drawn[3:])
    inverse = np.linalg.inv(small + 4 * np.eye(2))
    share = np.mean(np.einsum("ik,ij,jk->k", errors, inverse, errors) >= d2)
    assert p == pytest.approx(share, abs=CHANCE)
    assert p > 2 * chi2.sf(d2, 2)  # rare large mountings: chi-squared would call them the model's error too often


def test_inputs_that_are_rarely_far_off_count_as_often_as_they_are():
    """One draw in ten moves both quantities by 3: an error of 3 has a chance of about 0.1, not of 2e-5."""
    inputs = np.zeros((10, 2))
    inputs[0] = 3.0
    _, p = tail(np.array([2.8, 2.8]), 0.01 * np.eye(2), np.zeros(2), inputs=inputs)
    assert p == pytest.approx(0.1, abs=0.02)


def test_an_error_against_the_correlation_is_told_where_the_sum_of_squares_is_not():
    along, against = (record_verdict(rows(second=s, third=t), EFFECTS) for s, t in ((0.6, 1.2), (0.6, -1.2)))
    assert against.d2 > along.d2
    assert record_verdict(rows(cage=0.5), EFFECTS).p < 0.001
    assert record_verdict(rows(cage=-0.5), EFFECTS).d2 == pytest.approx(record_verdict(rows(cage=0.5), EFFECTS).d2)
    assert record_verdict(rows(cage=0.3), EFFECTS).p_discrepancy > record_verdict(rows(cage=0.3), EFFECTS).p


def test_holm_over_records():
    found = [replace(record_verdict(rows(), EFFECTS), p=p) for p in (0.04, 0.01, 0.03)]
    assert [one.p_holm for one in holm(found)] == pytest.approx([0.06, 0.03, 0.06])
    assert [one.verdict == "resolved" for one in holm(found)] == [False, True, False]
    assert holm([]) == ()


def test_agreement_is_shown_not_assumed():
    """A cage ratio alone can agree; a level cannot, whose mounting is known to 2 dB only."""
    (cage,) = (row("cage ratio", 0.02, 0.02, data=0.01, first=0.0),)
    assert record_verdict([cage], EFFECTS).verdict is ComparisonVerdict.AGREES
    wide = row("cage ratio", 0.02, 0.05, data=0.01, first=0.0)
    assert record_verdict([wide], EFFECTS).verdict is ComparisonVerdict.UNDECIDED
    unknown = replace(rows()[1], parts=rows()[1].parts | {"rig mounting": 1.96 * 2})
    assert record_verdict([cage, unknown], EFFECTS).verdict is ComparisonVerdict.UNDECIDED


def test_a_censored_level_counts_as_the_least_that_detection_allows_and_cannot_agree():
    hidden = QuantityValue(value=-20.0, present=False, least=-9.0)
    shown = QuantityValue(value=-4.0, ci95=0.5, first_ci95=0.3)
    low = row("2xBPFO", -16.0, 0.5, model=hidden, rig=shown)
    found = record_verdict([rows()[0], low], EFFECTS)
    assert found.errors[1] == pytest.approx(-5.0)
    assert (found.censored, found.agrees) == (("2xBPFO",), False)
    noisy = record_verdict([rows()[0], replace(low, model=replace(hidden, least=-2.0))], EFFECTS)
    assert noisy.errors[1] == 0.0  # what is not seen may be as high as the rig's
    other = record_verdict([rows()[0], row("2xBPFO", 9.0, 0.5, model=shown, rig=replace(hidden, ci95=0.5))], EFFECTS)
    assert other.errors[1] == pytest.approx(5.0)
    neither = record_verdict([rows()[0], row("2xBPFO", 0.0, 0.5, model=hidden, rig=hidden)], EFFECTS)
    assert neither.quantities == ("cage ratio",)


def test_nothing_is_said_without_inputs_or_frequency():
    assert record_verdict(rows(), None) is None
    assert record_verdict(rows()[1:], EFFECTS) is None


def test_false_resolved_at_its_nominal_rate():
    """Right models: errors drawn from the covariance, the inputs' draws and a mounting of unknown size."""
    rng = np.random.default_rng(11)
    own, levels, count = covariance(rows()), np.array([0.0, 1.0, 1.0]), 1000
    inputs = (VALUES - 1.0) * [200, 1, 1]
    spread, resolved = inputs.T @ inputs / len(inputs), 0
    for _ in range(count):
        error = np.linalg.cholesky(own + spread) @ rng.standard_normal(3)
        error += levels * 2.0 * rng.standard_normal() * rng.standard_normal(3)
        resolved += tail(error, own, levels, inputs=inputs, mounting=2.0)[1] < 0.05
    assert resolved / count == pytest.approx(0.05, abs=3 * np.sqrt(0.05 * 0.95 / count))
