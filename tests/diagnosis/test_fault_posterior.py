"""Posterior probabilities of classes from combs and lines."""

import math

import pytest

from srbval.bearing import Fault
from srbval.diagnosis.fault_posterior import (
    CLASS_PRIOR,
    CLASSES,
    EVEN_ODDS_DEPTH,
    LABELS,
    LOG_RATIO_ONSET,
    LOG_RATIO_SLOPE,
    MAX_PROBABILITY,
    OPEN,
    OTHER_CAUSE,
    RECORD_CORRELATION,
    SECOND_CAUSE_SHARE,
    UNDECIDED,
    Comb,
    FaultScores,
    decide,
    faults_of,
    log_likelihood,
    of_one_machine,
    probabilities,
)

DEEP = 0.7


def scores(second: dict[str, float] | None = None, depth: float = DEEP, **excess: float) -> FaultScores:
    """Scores with combs of these excesses, all of one depth; with `second` the strongest is masked."""
    names = ("outer", "inner", "roller", OTHER_CAUSE)
    first = {name: Comb(excess=excess.get(name, -1.0), found_hz=100.0, depth=depth) for name in names}
    strongest = max(first, key=lambda name: first[name].log_ratio)
    rest = {name: Comb(excess=e, found_hz=80.0, depth=depth) for name, e in (second or {}).items()}
    return FaultScores(first=first, second=rest, strongest=strongest, shaft_hz=25.0)


def said(*views: FaultScores, lines: dict[str, int] | None = None, stands: bool = False) -> dict[str, float]:
    return probabilities(log_likelihood(views, lines or {}, stands=stands or bool(lines)))


@pytest.mark.parametrize(
    ("given", "state"),
    [
        (scores(outer=12.0), "outer"),
        (scores(inner=11.0, outer=4.0), "inner"),
        (scores(roller=9.0), "roller"),
        (scores(other=9.0), OTHER_CAUSE),
        (scores(), "healthy"),
        (scores(outer=20.0, depth=0.1), "healthy"),  # a shallow line of a healthy bearing, in a long record
        (scores(outer=12.0, inner=12.0), UNDECIDED),  # of the same lines: no second comb beside the first
        (scores(outer=20.0, inner=12.0, second={"inner": 11.0}), "outer+inner"),
        (scores(outer=20.0, inner=12.0, second={"inner": 1.0}), "outer"),
        (scores(outer=12.0, other=20.0, second={"outer": 11.0}), "outer"),  # beside another machine's comb
        (scores(outer=9.0, other=20.0, second={"outer": 1.0}), OTHER_CAUSE),
    ],
)
def test_clear_records_are_called(given, state):
    shares = said(given)
    assert sum(shares.values()) == pytest.approx(1)
    assert max(shares.values()) <= MAX_PROBABILITY
    assert decide(shares) == state
    assert all(fault.label in LABELS[state] for fault in faults_of(state))


def test_the_log_ratio_is_the_equation_s():
    """1 / (exp(onset - slope x) + (depth / limit)^-(10 slope)): limited by what is smaller, excess or depth."""
    high, deep = LOG_RATIO_SLOPE * 8 - LOG_RATIO_ONSET, 10 * LOG_RATIO_SLOPE * math.log(2)
    assert Comb(excess=8, found_hz=1.0, depth=1e6).log_ratio == pytest.approx(high)
    assert Comb(excess=99, found_hz=1.0, depth=2 * EVEN_ODDS_DEPTH).log_ratio == pytest.approx(deep)
    both = Comb(excess=8, found_hz=1.0, depth=2 * EVEN_ODDS_DEPTH).log_ratio
    assert both == pytest.approx(-math.log(math.exp(-high) + math.exp(-deep)))
    assert Comb(excess=99, found_hz=1.0, depth=1.0, explained_by="the mains").log_ratio == -LOG_RATIO_ONSET


def test_lines_of_the_table_and_combs_are_one_evidence():
    """A line opens the question, a comb of the same part answers it; a line that has risen needs a weaker comb."""
    weak, weaker, silent = scores(outer=4.6), scores(outer=3.5), scores()
    assert said(silent)["healthy"] == pytest.approx(0.5 / (0.5 + CLASS_PRIOR[OPEN]), abs=0.01)
    shown = said(silent, lines={"outer": 1})
    assert shown["healthy"] < 0.5 < shown[OPEN]
    assert decide(said(weak)) == UNDECIDED
    assert decide(said(weak, lines={"outer": 1})) == "outer"
    assert [decide(said(weaker, lines={"outer": number})) for number in (1, 2)] == [UNDECIDED, "outer"]
    assert decide(said(silent, lines={"outer": 2})) == UNDECIDED, "a line that rose without its comb may be another's"
    assert decide(said(scores(inner=12.0), lines={"outer": 2})) == "inner", "a clear comb is not taken back"


def test_a_class_shown_by_one_of_several_channels_is_called_and_the_others_are_paid_for():
    alone, several = (
        log_likelihood(views, {}, stands=False)
        for views in ([scores(outer=14.0)], [scores(outer=14.0)] + 2 * [scores()])
    )
    assert several["outer"] == pytest.approx(alone["outer"] - math.log(3), abs=0.01)
    assert decide(probabilities(several)) == "outer"
    assert said(scores(), scores()) == pytest.approx(said(scores()))


def test_records_of_one_machine_say_more_than_one_and_less_than_as_many():
    """Faint signs of one fault in four records name it; many are worth two at most; an open line stays open."""
    faint = log_likelihood([scores(inner=4.6)], {}, stands=False)
    assert decide(probabilities(faint)) == UNDECIDED
    assert of_one_machine([faint]) == faint
    four, many = of_one_machine([faint] * 4), of_one_machine([faint] * 1000)
    assert decide(probabilities(four)) == "inner"
    for name in (*Fault,)[1:]:
        assert four[name] == pytest.approx(4 / (1 + 3 * RECORD_CORRELATION) * faint[name])
        assert abs(many[name]) <= abs(faint[name]) / RECORD_CORRELATION
    lined = log_likelihood([scores()], {"outer": 1}, stands=True)
    assert probabilities(of_one_machine([lined] + 3 * [log_likelihood([scores()], {}, stands=False)]))["healthy"] < 0.5
    assert lined[OPEN] == pytest.approx(-math.log(SECOND_CAUSE_SHARE))
    assert set(lined) == set(CLASSES)
