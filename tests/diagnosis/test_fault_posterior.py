"""Posterior probabilities of classes from combs and lines."""

import math

import pytest

from srbval.bearing import Fault
from srbval.diagnosis import fault_posterior as posterior

DEEP = 0.7


def scores(second: dict[str, float] | None = None, depth: float = DEEP, **excess: float) -> posterior.FaultScores:
    """Scores with combs of these excesses, all of one depth; with `second` the strongest is masked."""
    names = ("outer", "inner", "roller", posterior.OTHER_CAUSE)
    first = {name: posterior.Comb(excess=excess.get(name, -1.0), found_hz=100.0, depth=depth) for name in names}
    strongest = max(first, key=lambda name: first[name].log_ratio)
    rest = {name: posterior.Comb(excess=e, found_hz=80.0, depth=depth) for name, e in (second or {}).items()}
    return posterior.FaultScores(first=first, second=rest, strongest=strongest, shaft_hz=25.0)


def said(*views: posterior.FaultScores, lines: dict[str, int] | None = None, stands: bool = False) -> dict[str, float]:
    return posterior.probabilities(posterior.log_likelihood(views, lines or {}, stands=stands or bool(lines)))


@pytest.mark.parametrize(
    ("given", "state"),
    [
        (scores(outer=12.0), "outer"),
        (scores(inner=11.0, outer=4.0), "inner"),
        (scores(roller=9.0), "roller"),
        (scores(other=9.0), posterior.OTHER_CAUSE),
        (scores(), "healthy"),
        (scores(outer=20.0, depth=0.1), "healthy"),  # a shallow line of a healthy bearing, in a long record
        (scores(outer=12.0, inner=12.0), posterior.UNDECIDED),  # of the same lines: no second comb beside the first
        (scores(outer=20.0, inner=12.0, second={"inner": 11.0}), "outer+inner"),
        (scores(outer=20.0, inner=12.0, second={"inner": 1.0}), "outer"),
        (scores(outer=12.0, other=20.0, second={"outer": 11.0}), "outer"),  # beside another machine's comb
        (scores(outer=9.0, other=20.0, second={"outer": 1.0}), posterior.OTHER_CAUSE),
    ],
)
def test_clear_records_are_called(given, state):
    shares = said(given)
    assert sum(shares.values()) == pytest.approx(1)
    assert max(shares.values()) <= posterior.MAX_PROBABILITY
    assert posterior.decide(shares) == state
    assert all(fault.label in posterior.LABELS[state] for fault in posterior.faults_of(state))


def test_the_log_ratio_is_the_equation_s():
    """1 / (exp(onset - slope x) + (depth / limit)^-(10 slope)): limited by what is smaller, excess or depth."""
    high, deep = posterior.LOG_RATIO_SLOPE * 8 - posterior.LOG_RATIO_ONSET, 10 * posterior.LOG_RATIO_SLOPE * math.log(2)
    assert posterior.Comb(excess=8, found_hz=1.0, depth=1e6).log_ratio == pytest.approx(high)
    assert posterior.Comb(excess=99, found_hz=1.0, depth=2 * posterior.EVEN_ODDS_DEPTH).log_ratio == pytest.approx(deep)
    both = posterior.Comb(excess=8, found_hz=1.0, depth=2 * posterior.EVEN_ODDS_DEPTH).log_ratio
    assert both == pytest.approx(-math.log(math.exp(-high) + math.exp(-deep)))
    mains = posterior.Comb(excess=99, found_hz=1.0, depth=1.0, explained_by="the mains")
    assert mains.log_ratio == -posterior.LOG_RATIO_ONSET


def test_lines_of_the_table_and_combs_are_one_evidence():
    """A line opens the question, a comb of the same part answers it; a line that has risen needs a weaker comb."""
    weak, weaker, silent = scores(outer=4.6), scores(outer=3.5), scores()
    assert said(silent)["healthy"] == pytest.approx(0.5 / (0.5 + posterior.CLASS_PRIOR[posterior.OPEN]), abs=0.01)
    shown = said(silent, lines={"outer": 1})
    assert shown["healthy"] < 0.5 < shown[posterior.OPEN]
    assert posterior.decide(said(weak)) == posterior.UNDECIDED
    assert posterior.decide(said(weak, lines={"outer": 1})) == "outer"
    named = [posterior.decide(said(weaker, lines={"outer": number})) for number in (1, 2)]
    assert named == [posterior.UNDECIDED, "outer"]
    alone = posterior.decide(said(silent, lines={"outer": 2}))
    assert alone == posterior.UNDECIDED, "a line that rose without its comb may be another's"
    assert posterior.decide(said(scores(inner=12.0), lines={"outer": 2})) == "inner", "a clear comb is not taken back"


def test_a_class_shown_by_one_of_several_channels_is_called_and_the_others_are_paid_for():
    shown = [scores(outer=14.0)]
    alone, several = (posterior.log_likelihood(views, {}, stands=False) for views in (shown, shown + 2 * [scores()]))
    assert several["outer"] == pytest.approx(alone["outer"] - math.log(3), abs=0.01)
    assert posterior.decide(posterior.probabilities(several)) == "outer"
    assert said(scores(), scores()) == pytest.approx(said(scores()))


def test_records_of_one_machine_say_more_than_one_and_less_than_as_many():
    """Faint signs of one fault in four records name it; many are worth two at most; an open line stays open."""
    faint = posterior.log_likelihood([scores(inner=4.6)], {}, stands=False)
    assert posterior.decide(posterior.probabilities(faint)) == posterior.UNDECIDED
    assert posterior.of_one_machine([faint]) == faint
    four, many = posterior.of_one_machine([faint] * 4), posterior.of_one_machine([faint] * 1000)
    assert posterior.decide(posterior.probabilities(four)) == "inner"
    for name in (*Fault,)[1:]:
        assert four[name] == pytest.approx(4 / (1 + 3 * posterior.RECORD_CORRELATION) * faint[name])
        assert abs(many[name]) <= abs(faint[name]) / posterior.RECORD_CORRELATION
    lined = posterior.log_likelihood([scores()], {"outer": 1}, stands=True)
    silent = posterior.log_likelihood([scores()], {}, stands=False)
    machine = posterior.of_one_machine([lined] + 3 * [silent])
    assert posterior.probabilities(machine)["healthy"] < 0.5
    assert lined[posterior.OPEN] == pytest.approx(-math.log(posterior.SECOND_CAUSE_SHARE))
    assert set(lined) == set(posterior.CLASSES)
