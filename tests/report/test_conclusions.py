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

TREND = "353 rpm less 877 rpm"


def verdict(scene: str, endpoint: str, answer: str, error: float = 0.1234, **more: Any) -> dict[str, Any]:
    return {
        "scene": scene,
        "endpoint": endpoint,
        "verdict": answer,
        "error_pct": error,
        "u_pct": 0.05,
        "reversed_by": [],
    } | more


def test_the_headline_names_each_scene_at_the_fastest_speed_and_its_change() -> None:
    rows = [verdict("rig", "877 rpm", "met"), verdict("paper", "877 rpm", "missed"), verdict("paper", TREND, "met")]
    assert headline(rows, TREND, "353 rpm", "877 rpm") == (
        "Cage speed within 0.1 % of the rig's: paper's scene missed at 877 rpm (+0.12 ± 0.05 %), change to 353 rpm met "
        "(+0.12 ± 0.05 %); the rig's own scene met at 877 rpm (+0.12 ± 0.05 %)."
    )
    assert "change" not in headline(rows, "877 rpm", "877 rpm", "877 rpm"), "one speed has no change"
    assert headline([], TREND, "353 rpm", "877 rpm").startswith(
        "How far the model's cage speed is from the rig's is not"
    )


@pytest.mark.parametrize(
    ("answers", "tone"),
    [(["met", "missed"], Tone.BAD), (["met", "not resolved"], Tone.NEUTRAL), (["met"], Tone.GOOD), ([], Tone.WARNING)],
)
def test_the_tone_is_that_of_the_worst_answer(answers: list[str], tone: Tone) -> None:
    assert tone_of(iter(answers)) is tone


def test_the_trend_names_the_model_only_if_it_is_known() -> None:
    trend = {"rig_pct": 0.22, "rig_ci95_pct": 0.08, "model_pct": None}
    assert "scene" not in trend_sentence(trend, "353 rpm", "877 rpm")
    assert "`rig` it changes by -0.02 %" in trend_sentence(trend | {"model_pct": -0.02}, "353 rpm", "877 rpm")


def test_a_verdict_that_one_input_turns_has_a_note_and_a_missed_one_its_sentence() -> None:
    rows = [verdict("rig", TREND, "missed", -0.2, reversed_by=["osculation"]), verdict("rig", "877 rpm", "met")]
    assert reversed_notes(rows) == (f"rig, {TREND}: met and missed occur over the range of osculation.",)
    (missed,) = missed_sentence(rows)
    assert "the cause of the error of -0.20 % is not known." in missed
    assert list(missed_sentence(rows[1:])) == []


def test_the_measured_sum_and_lines_are_named_as_far_as_they_are_there() -> None:
    own = {"origin": "measured", "speed_source": "tachometer", "line": "BPFI", "slip_pct": 0.04, "slip_ci95_pct": 0.03}
    sums = [{"total": 19.001, "ci95": 0.01}]
    assert measured_sentence([], []) == ""
    assert measured_sentence([], [own | {"origin": "published"}]) == ""
    assert measured_sentence([], [own]) == " Single lines deviate by BPFI +0.04 ± 0.03 %."
    assert measured_sentence(sums, []).endswith("add up to 19.001 ± 0.010 orders.")
    many = measured_sentence(sums, [own] * (LISTED + 1))
    assert many.endswith("orders; single lines deviate by +0.04 to +0.04 % in 5 race-fault records.")


def test_sidebands_of_a_line_that_was_not_read_are_said_to_be_missing() -> None:
    shares = {"model": {"at_one": 0.1, "at_two": 0.25}, "rig": None}
    assert sidebands_sentence(shares) == "model: 0.10 at one shaft speed, 0.25 at two; rig: line not read"


@pytest.mark.parametrize("blind", [False, True])
@pytest.mark.parametrize("outcome", [{}, {"comparisons": []}])
def test_blind_records_and_stored_predictions_are_named(blind: bool, outcome: dict[str, Any]) -> None:
    rows = [{"record": "set/a.mat", "used_for": "blind" if blind else "withheld"}]
    text = blind_sentence(rows, predicted=bool(outcome))
    assert ("a.mat" in text) is blind
    assert ("Predictions of the amplitudes" in text) is bool(outcome)


def rows_of(**alarms: int) -> list[dict[str, Any]]:
    return [{"alarm": alarm, "name": "a*b", "state": "x"} for alarm, n in alarms.items() for _ in range(n)]


@pytest.mark.parametrize(
    ("alarms", "start"),
    [
        ({"yes": 2, "check": 1}, "A fault is named in 2 of 3 recordings; 1 undecided"),
        ({"yes": 1, "no": 1}, "A fault is named in 1 of 2 recordings"),
        ({"check": 1, "no": 1}, "Undecided: strong lines that are not explained in 1 of 2"),
        ({"no": 2}, "Nothing found in 2 of 2"),
        ({"-": 1}, "No recording is a measured one"),
    ],
)
def test_the_headline_of_several_recordings_is_the_worst_finding(alarms: dict[str, int], start: str) -> None:
    assert headline_of_all(rows_of(**alarms)).startswith(start)


def test_points_of_several_recordings_list_a_few_names_and_count_the_rest() -> None:
    named, undecided, failed = points_of_all(rows_of(yes=MOST_NAMED + 2, check=1), 2)
    assert named.startswith(r"**Named:** a\*b (x), a\*b")
    assert named.endswith(" and 2 more.")
    assert undecided == r"**Undecided:** a\*b."
    assert "2 files that could not be read" in failed
    assert list(points_of_all(rows_of(no=1), 0)) == []


@pytest.mark.parametrize("why", [None, *NotDetected])
@pytest.mark.parametrize("snr", [None, 2.0])
def test_every_reason_why_a_line_is_not_seen_has_its_sentence(why: NotDetected | None, snr: float | None) -> None:
    if snr is None and why not in (NotDetected.HIDDEN, NotDetected.OUT_OF_REACH, None):
        return
    line = SimpleNamespace(
        not_detected=why, snr=snr, explained_by="2x*BPFO", noise_false_alarm=0.2, placebo_false_alarm=0.3
    )
    text = unseen_reason(line, reach_hz=500.0, least_snr=3.0)  # type: ignore[arg-type]
    assert text.endswith(".")
    assert ("times the noise, cannot be told" in text) is (why is NotDetected.HIDDEN and snr is not None)


def test_the_points_of_a_trend_say_how_sure_it_is_only_if_something_was_compared() -> None:
    channel = SimpleNamespace(velocity_missing="the unit is V")
    trend = SimpleNamespace(comparisons=0, baseline=5, false_alarm=0.05, channels=(channel, channel))
    assert [point[:14] for point in trend_points(trend)] == ["**No zone of I", "**Level:** the"]  # type: ignore[arg-type]
    trend = SimpleNamespace(comparisons=10, baseline=5, false_alarm=0.05, channels=())
    sure, _ = trend_points(trend)  # type: ignore[arg-type]
    assert "a limit leaves each a chance of 0.005" in sure


@pytest.mark.parametrize("applies", [False, True])
def test_limits_are_listed_as_far_as_they_apply(applies: bool) -> None:
    speed = SimpleNamespace(source=SpeedSource.NOMINAL if applies else SpeedSource.TACHOMETER)
    analysis = SimpleNamespace(band=SimpleNamespace(trials=1 + applies), speed=speed)
    items = list(limit_items([SimpleNamespace(baseline=None if applies else object(), analysis=analysis)]))  # type: ignore[list-item]
    assert len(items) == (6 if applies else 3)
