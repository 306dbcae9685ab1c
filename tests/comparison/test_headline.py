"""The headline: what a tolerance, an interval and a scan of every input together allow to be stated."""

import pytest

from srbval.bearing import Fault
from srbval.comparison.budget import TOLERANCE, Answer
from srbval.comparison.comparison import RIG_READING, Comparison, QuantityValue
from srbval.comparison.effects import INPUTS
from srbval.comparison.headline import headline

LIMIT = TOLERANCE.limit_pct
RATIO = 0.431  # of a cage over its shaft


def compared(error_pct, u_pct, fault=Fault.OUTER):
    return Comparison(
        kind="cage ratio", fault=fault, quantity="cage ratio", unit="1", error_unit="%", record="r",
        model=QuantityValue(value=RATIO * (1 + error_pct / 100)), rig=QuantityValue(value=RATIO),
        error=error_pct, parts={RIG_READING: 0.0, INPUTS: u_pct}, margin=LIMIT,
    )  # fmt: skip


def scanned(*rows, defect="outer", scene="paper"):
    """A stored scan: name, errors and answers of each row."""
    return {"rows": [
        {"scene": scene, "defect": defect, "kind": "input", "name": name, "errors_pct": errors, "answers": answers}
        for name, errors, answers in rows
    ]}  # fmt: skip


@pytest.mark.parametrize(
    ("error_pct", "u_pct", "answer"),
    [
        (0.5 * LIMIT, 0.4 * LIMIT, Answer.MET),
        (-0.5 * LIMIT, 0.4 * LIMIT, Answer.MET),
        (0.5 * LIMIT, 0.6 * LIMIT, Answer.NOT_RESOLVED),
        (1.5 * LIMIT, 2.0 * LIMIT, Answer.NOT_RESOLVED),
        (-1.5 * LIMIT, 0.6 * LIMIT, Answer.NOT_RESOLVED),
        (-1.5 * LIMIT, 0.4 * LIMIT, Answer.MISSED),
        (0.5 * LIMIT, None, Answer.NOT_RESOLVED),
    ],
)
def test_only_a_whole_interval_on_one_side_answers(error_pct, u_pct, answer):
    assert TOLERANCE.answer(error_pct, u_pct) is answer


def test_one_record_that_misses_is_enough_and_all_must_meet():
    met, missed, wide = (0.1 * LIMIT, 0.1 * LIMIT), (3 * LIMIT, LIMIT), (0.0, 5 * LIMIT)
    for pairs, answer in (
        ([met, met], Answer.MET), ([met, wide], Answer.NOT_RESOLVED), ([wide, missed], Answer.MISSED),
        ([], Answer.NOT_RESOLVED),
    ):  # fmt: skip
        found = headline([compared(*pair) for pair in pairs], None, None)
        assert found.answer is answer
        assert found.holds is (answer is not Answer.MISSED)


def test_what_no_error_exceeds_counts_the_interval():
    rows = [compared(-0.2, 0.3), compared(0.1, 0.35)]
    assert headline(rows, None, None).within_pct == pytest.approx(0.5)
    assert headline([], None, None).within_pct is None


def test_an_input_that_turns_the_answer_leaves_it_unresolved_and_is_named():
    row = compared(3 * LIMIT, LIMIT)
    steady = ("load", [0.29, 0.31], ["missed", "missed"])
    nominal = ("", [0.3], ["missed"])
    turning = ("traction", [0.05, 0.3], ["met", "missed"])
    (kept,) = headline([row], None, scanned(nominal, steady)).errors
    assert (kept.answer, kept.turned_by, kept.scanned_pct) == (Answer.MISSED, (), (0.29, 0.31))
    (open_one,) = headline([row], None, scanned(nominal, steady, turning)).errors
    assert (open_one.answer, open_one.turned_by) == (Answer.NOT_RESOLVED, ("traction",))
    assert open_one.reversed_by == ("traction",)
    blurred = ("reading", [0.2], ["not resolved"])
    (vague,) = headline([row], None, scanned(nominal, blurred)).errors
    assert (vague.answer, vague.turned_by, vague.reversed_by) == (Answer.NOT_RESOLVED, ("reading",), ())
    assert open_one.scanned_pct == (0.05, 0.31)
    (other,) = headline([row], None, scanned(nominal, turning, defect="inner")).errors
    assert other.turned_by == ()  # another record's scan says nothing of this one


@pytest.mark.parametrize(("kind", "factor"), [("outer", 1.0), ("inner", (1 - RATIO) / RATIO)])
def test_the_rig_scene_is_stated_in_per_cent_of_the_cage_ratio(kind, factor):
    """Its study is in per cent of the line, BPFI is Z (1 - c): an error of the line there has the other sign."""
    study = {
        "of": {"record": "r", "kind": kind, "cage_ratio": RATIO}, "nominal": 1.001 * RATIO, "uncertainty_pct": 0.02,
    }  # fmt: skip
    (found,) = headline([], {"studies": [study, study | {"uncertainty_pct": None}]}, None).rig_scene
    assert found.error_pct == pytest.approx(0.1)
    assert found.uncertainty_pct == pytest.approx(0.02 * factor)
