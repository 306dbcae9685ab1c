"""Sentences that depend on a result: every branch of every function is reached."""

from types import SimpleNamespace
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.reading.lines import NotDetected
from srbval.recordings import SpeedSource
from srbval.report.blocks import Tone
from srbval.report.sections import answer
from srbval.report.sections.figures import level_sentence, picture_verdict
from srbval.report.sections.table6 import parts_sentence, trend_sentence
from srbval.report.sections.trend import trend_points
from srbval.report.sections.user_report import headline_of_all, limit_items, unseen_reason

CHANGE = "353 less 877 rpm"


def verdict(scene: str, endpoint: str, answer: str) -> dict[str, Any]:
    return {"scene": scene, "endpoint": endpoint, "verdict": answer, "error_pct": 0.1234, "u_pct": 0.05}


def data(change: str | None, within: int, u: float | None = 0.05) -> dict[str, Any]:
    """Content of ``report.json`` as far as the answer needs it."""
    line = {"rig_source": "measured", "line": "BPFI", "defect": "inner", "verdict": "differs"}
    return {
        "table6": [line | {"comparison_error_pct": -0.13, "validation_uncertainty_pct": u}],
        "verdicts": [verdict("rig", "877 rpm", "met")] if change else [],
        "trend": {"verdict": change, "rig_pct": 0.22, "rig_ci95_pct": 0.08, "model_pct": 0.0},
        "amplitudes": {"locked": {"within": within, "of": 21}},
    }


def shaft(difference: float) -> str:
    row = {"source": "paper's rig", "difference_pct": difference, "implied_rpm": 706.6, "stated_rpm": 710.0}
    return answer.shaft_sentence([row], {"paper_rig_printed_pct": -1.0})


def picture(what: str, model: float, rig: float = 0.0, state: str = "outer") -> dict[str, Any]:
    about = {"what": what, "unit": "dB", "state": state, "kind": "spectrum", "limit": 3.0}
    return about | {"model": model, "rig": rig, "alike": abs(model - rig) <= 3.0}


def level(name: str, model: float | None) -> str:
    """Sentence on a line of the model; None if the line was not read."""
    return level_sentence([] if model is None else [picture("a line", model)], "a line", name)


STATED = [verdict("rig", "877 rpm", "met"), verdict("paper", "877 rpm", "missed"), verdict("rig", CHANGE, "missed")]
TREND = {"rig_pct": 0.22, "rig_ci95_pct": 0.08, "model_pct": 0.0, "u_pct": 0.08}

PARTS = [{"line": "BPFO", "uncertainty_parts_pct": {"rig reading": 0.04, "inputs: all together": 0.02}}]
USED = [{"record": "OR_877rpm_sample.mat", "used_for": "fit"}, {"record": "IR.mat", "used_for": "withheld"}]
READ = [SimpleNamespace(record=name) for name in ("OR_877rpm_sample.mat", "H_877rpm_sample.mat")]
SENTENCES = [  # text, words that it has, words that it has not
    (
        answer.finding_sentence(STATED),
        "in the paper's scene (the ratio at 877 rpm) and in the rig's scene (the ch",
        "nowhere",
    ),
    (answer.finding_sentence(STATED[:1]), "misses its tolerance of 0.1 % nowhere", "finding"),
    (answer.finding_sentence([]), "is not known", "finding"),
    (
        answer.near_sentence(data("met", 21)),
        "-0.13 ± 0.05 % (inner race, BPFI: differs) in the paper's scene",
        "unknown",
    ),
    (answer.near_sentence(data("met", 21)), "which sets both lines, deviates by +0.12 ± 0.05 % (met)", "unknown"),
    (answer.near_sentence(data(None, 21, None)), "-0.13 %, uncertainty unknown (inner race", "rig's scene"),
    (answer.missing_sentence(data("missed", 9)), "model 0.00 %) and the vibration levels (only 9 of 21 ", "Everything"),
    (answer.missing_sentence(data("not resolved", 21)), "Everything that was compared", "Not reproduced"),
    (shaft(-0.48), "-1 % is a slower shaft, not slip**", None),
    (shaft(0.48), "is a faster shaft, not slip**", None),
    (shaft(0.05), "The paper's -1 % may be slip", "shaft"),
    (
        answer.used_sentence(USED, READ),
        "OR 877 fitted, for levels only; none unknown before the comparison; 1 seen",
        None,
    ),
    (answer.used_sentence([{**USED[0], "used_for": "blind"}], READ), "the comparison: OR 877", "none unknown"),
    (answer.stored_sentence([]), "nothing", None),
    (picture_verdict([picture("a", 1.0), picture("b", -9.0)], "spectrum", Fault.OUTER), "differs: b -9 dB", "alike"),
    (picture_verdict([picture("a", 1.0), picture("b", -9.0, state="inner")], "spectrum", Fault.OUTER), "alike: a", "b"),
    (picture_verdict([picture("a", 1.0)], "acceleration", Fault.OUTER), "not compared", "alike"),
    (level("fifth", -18.0), "As in the paper, the model's fifth harmonic is missing", None),
    (level("fifth", -1.0), "Unlike in the paper", "missing"),
    (level("fifth", None), "was not read", "paper"),
    (level("sidebands", -17.0), "struck in the load zone only", None),
    (level("sidebands", 1.0), "Both defects", "zone"),
    (level("sidebands", None), "not read", None),
    (trend_sentence(TREND), "exceeds its uncertainty of 0.08 %; its cause is not known", "within"),
    (trend_sentence(TREND | {"model_pct": 0.2}), "within its uncertainty of 0.08 %", "exceeds"),
    (trend_sentence(TREND | {"model_pct": None}), "+0.22 ± 0.08 % at 353", "scene"),
    (parts_sentence(PARTS), "BPFO rig reading 0.040, inputs 0.020", "all together"),
    (headline_of_all(["yes", "check", "yes"]), "A fault is named in 2 of 3 recordings; 1 undecided", None),
    (headline_of_all(["yes", "no"]), "A fault is named in 1 of 2 recordings", "undecided"),
    (headline_of_all(["check", "no"]), "Undecided: strong lines that are not explained in 1 of 2", "named"),
    (headline_of_all(["no", "no"]), "Nothing found in 2 of 2", None),
    (headline_of_all(["-"]), "No recording is measured", None),
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
    assert answer.worst_tone(iter(answers)) is tone


@pytest.mark.parametrize("why", NotDetected)
def test_every_reason_why_a_line_is_not_seen_has_its_sentence(why):
    given = {"not_detected": why, "snr": 2.0, "noise_false_alarm": 0.2, "placebo_false_alarm": 0.3}
    text = unseen_reason(SimpleNamespace(**given, explained_by="2x*BPFO"), reach_hz=500.0, least_snr=3.0)
    assert text.endswith(".")


def test_the_points_of_a_trend_say_how_sure_it_is_only_if_something_was_compared():
    channel = SimpleNamespace(velocity_missing="the unit is V")
    trend = SimpleNamespace(comparisons=0, baseline=5, false_alarm=0.05, channels=(channel, channel))
    assert [point[:14] for point in trend_points(trend)] == ["**No zone of I", "**Level:** the"]
    sure, _ = trend_points(SimpleNamespace(comparisons=10, baseline=5, false_alarm=0.05, channels=()))
    assert "one limit is exceeded by chance with probability 0.005" in sure


@pytest.mark.parametrize("applies", [False, True])
def test_limits_are_listed_as_far_as_they_apply(applies):
    speed = SimpleNamespace(source=SpeedSource.NOMINAL if applies else SpeedSource.TACHOMETER)
    analysis = SimpleNamespace(band=SimpleNamespace(trials=1 + applies), speed=speed)
    items = list(limit_items([SimpleNamespace(baseline=None if applies else object(), analysis=analysis)]))
    assert len(items) == (6 if applies else 3)
