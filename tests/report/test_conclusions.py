"""Sentences that depend on an outcome: each function of them reaches each of its branches."""

from types import SimpleNamespace
from typing import Any

import pytest

from srbval.reading.lines import NotDetected
from srbval.recordings import SpeedSource
from srbval.report.blocks import Tone
from srbval.report.sections.answer import headline, reversed_notes, tone_of, trend_sentence
from srbval.report.sections.assemble import blind_sentence, missed_sentence
from srbval.report.sections.figures import sidebands_sentence
from srbval.report.sections.table6 import LISTED, measured_sentence
from srbval.report.sections.trend import trend_points
from srbval.report.sections.user_texts import MOST_NAMED, headline_of_all, limit_items, points_of_all, unseen_reason

SPEEDS = ("353 rpm", "877 rpm")
TREND = "353 rpm less 877 rpm"


def verdict(scene: str, endpoint: str, answer: str, error: float = 0.1234, **more: Any) -> dict[str, Any]:
    own = {"scene": scene, "endpoint": endpoint, "verdict": answer, "error_pct": error, "u_pct": 0.05}
    return own | {"reversed_by": []} | more


def rows_of(**alarms: int) -> list[dict[str, Any]]:
    return [{"alarm": alarm, "name": "a*b", "state": "x"} for alarm, n in alarms.items() for _ in range(n)]


def blind(used_for: str, predicted: bool) -> str:
    return blind_sentence([{"record": "set/a.mat", "used_for": used_for}], predicted=predicted)


STATED = [verdict("rig", "877 rpm", "met"), verdict("paper", "877 rpm", "missed"), verdict("paper", TREND, "met")]
TURNED = [verdict("rig", TREND, "missed", -0.2, reversed_by=["osculation"]), verdict("rig", "877 rpm", "met")]
CHANGE = {"rig_pct": 0.22, "rig_ci95_pct": 0.08, "model_pct": None}
LINE = {"speed_source": "tachometer", "line": "BPFI", "slip_pct": 0.04, "slip_ci95_pct": 0.03}
SUMS = [{"total": 19.001, "ci95": 0.01}]
SHARES = {"model": {"at_one": 0.1, "at_two": 0.25}, "rig": None}
BLIND, PREDICTED = "a.mat", "Predictions of the amplitudes"
SENTENCES = [  # text, words that it has, words that it has not
    (
        headline(STATED, TREND, *SPEEDS),
        "Cage speed within 0.1 % of the rig's: paper's scene missed at 877 rpm (+0.12 ± 0.05 %), change to 353 rpm met "
        "(+0.12 ± 0.05 %); the rig's own scene met at 877 rpm (+0.12 ± 0.05 %).",
        None,
    ),
    (headline(STATED, "877 rpm", "877 rpm", "877 rpm"), "met at 877 rpm", "change"),  # one speed has no change
    (headline([], TREND, *SPEEDS), "The error of the model's cage speed is not known", None),
    (trend_sentence(CHANGE, *SPEEDS), "", "scene"),
    (trend_sentence(CHANGE | {"model_pct": -0.02}, *SPEEDS), "`rig` it changes by -0.02 %", None),
    (
        " ".join(reversed_notes(TURNED)),
        f"rig, {TREND}: met and missed occur over the range of osculation.",
        "g, 877 rpm:",
    ),
    (" ".join(missed_sentence(TURNED)), "the cause of the error of -0.20 % is not known.", "+0.12"),
    (measured_sentence([], []) + measured_sentence([], [LINE | {"speed_source": "the lines"}]), "", " "),
    (measured_sentence([], [LINE]), " Single lines deviate by BPFI +0.04 ± 0.03 %.", None),
    (measured_sentence(SUMS, []), "add up to 19.001 ± 0.010 orders.", "deviate"),
    (
        measured_sentence(SUMS, [LINE] * (LISTED + 1)),
        "orders; single lines deviate by +0.04 to +0.04 % in 5 race-fault records.",
        None,
    ),
    (sidebands_sentence(SHARES), "model: 0.10 at one shaft speed, 0.25 at two; rig: line not read", None),
    (blind("blind", False), BLIND, PREDICTED),
    (blind("withheld", True), PREDICTED, BLIND),
    (headline_of_all(rows_of(yes=2, check=1)), "A fault is named in 2 of 3 recordings; 1 undecided", None),
    (headline_of_all(rows_of(yes=1, no=1)), "A fault is named in 1 of 2 recordings", "undecided"),
    (headline_of_all(rows_of(check=1, no=1)), "Undecided: strong lines that are not explained in 1 of 2", "named"),
    (headline_of_all(rows_of(no=2)), "Nothing found in 2 of 2", None),
    (headline_of_all(rows_of(**{"-": 1})), "No recording is a measured one", None),
]


@pytest.mark.parametrize(("text", "words", "without"), SENTENCES)
def test_a_sentence_follows_from_its_outcome(text, words, without):
    assert words in text
    assert without is None or without not in text


@pytest.mark.parametrize(
    ("answers", "tone"),
    [(["met", "missed"], Tone.BAD), (["met", "not resolved"], Tone.NEUTRAL), (["met"], Tone.GOOD), ([], Tone.WARNING)],
)
def test_the_tone_is_that_of_the_worst_answer(answers, tone):
    assert tone_of(iter(answers)) is tone


def test_points_of_several_recordings_list_a_few_names_and_count_the_rest():
    named, undecided, failed = points_of_all(rows_of(yes=MOST_NAMED + 2, check=1), 2)
    assert named.startswith(r"**Named:** a\*b (x), a\*b")
    assert named.endswith(" and 2 more.")
    assert undecided == r"**Undecided:** a\*b."
    assert "2 files that could not be read" in failed
    assert list(points_of_all(rows_of(no=1), 0)) == []


@pytest.mark.parametrize("snr", [None, 2.0])
def test_every_reason_why_a_line_is_not_seen_has_its_sentence(snr):
    for why in (None, *NotDetected) if snr else (None, NotDetected.HIDDEN, NotDetected.OUT_OF_REACH):
        given = {"not_detected": why, "snr": snr, "noise_false_alarm": 0.2, "placebo_false_alarm": 0.3}
        text = unseen_reason(SimpleNamespace(**given, explained_by="2x*BPFO"), reach_hz=500.0, least_snr=3.0)
        assert text.endswith(".")
        assert ("times the noise, cannot be told" in text) is (why is NotDetected.HIDDEN and snr is not None)


def test_the_points_of_a_trend_say_how_sure_it_is_only_if_something_was_compared():
    channel = SimpleNamespace(velocity_missing="the unit is V")
    trend = SimpleNamespace(comparisons=0, baseline=5, false_alarm=0.05, channels=(channel, channel))
    assert [point[:14] for point in trend_points(trend)] == ["**No zone of I", "**Level:** the"]
    sure, _ = trend_points(SimpleNamespace(comparisons=10, baseline=5, false_alarm=0.05, channels=()))
    assert "a limit leaves each a chance of 0.005" in sure


@pytest.mark.parametrize("applies", [False, True])
def test_limits_are_listed_as_far_as_they_apply(applies):
    speed = SimpleNamespace(source=SpeedSource.NOMINAL if applies else SpeedSource.TACHOMETER)
    analysis = SimpleNamespace(band=SimpleNamespace(trials=1 + applies), speed=speed)
    items = list(limit_items([SimpleNamespace(baseline=None if applies else object(), analysis=analysis)]))
    assert len(items) == (6 if applies else 3)
