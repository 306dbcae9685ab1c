"""The headline: what a tolerance, an interval and a scan of every input together allow to be stated."""

import pytest

from srbval.bearing import Fault
from srbval.comparison.budget import TOLERANCE, Answer
from srbval.comparison.comparison import RIG_READING, Comparison, QuantityValue
from srbval.comparison.effects import INPUTS
from srbval.comparison.headline import headline

LIMIT = TOLERANCE.limit_pct
RATIO = 0.431  # of a cage over its shaft


def compared(error_pct, u_pct):
    return Comparison(
        kind="cage ratio", state=Fault.OUTER, quantity="cage ratio", unit="1", error_unit="%", record="r",
        model=QuantityValue(value=RATIO * (1 + error_pct / 100)), rig=QuantityValue(value=RATIO),
        error=error_pct, parts={RIG_READING: 0.0, INPUTS: u_pct}, margin=LIMIT,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("error", "u", "answer"),
    [
        (0.5, 0.4, Answer.MET), (-0.5, 0.4, Answer.MET), (0.5, 0.6, Answer.NOT_RESOLVED),
        (1.5, 2.0, Answer.NOT_RESOLVED), (-1.5, 0.6, Answer.NOT_RESOLVED), (-1.5, 0.4, Answer.MISSED),
        (0.5, None, Answer.NOT_RESOLVED),
    ],
)  # fmt: skip
def test_only_a_whole_interval_on_one_side_answers(error, u, answer):
    assert TOLERANCE.answer(error * LIMIT, None if u is None else u * LIMIT) is answer


def test_one_record_that_misses_is_enough_and_all_must_meet():
    met, missed, wide = (0.1 * LIMIT, 0.1 * LIMIT), (3 * LIMIT, LIMIT), (0.0, 5 * LIMIT)
    for pairs, answer in (
        ([met, met], Answer.MET), ([met, wide], Answer.NOT_RESOLVED), ([wide, missed], Answer.MISSED),
        ([], Answer.NOT_RESOLVED),
    ):  # fmt: skip
        found = headline([compared(*pair) for pair in pairs], None, None)
        assert found.answer is answer
        assert found.holds is (answer is not Answer.MISSED)


def test_an_input_that_turns_the_answer_leaves_it_unresolved_and_is_named():
    def found(*scanned, defect="outer"):
        names = ("name", "errors_pct", "answers")
        about = {"scene": "paper", "defect": defect, "kind": "input"}
        stored = {"rows": [about | dict(zip(names, row, strict=True)) for row in scanned]}
        return headline([compared(3 * LIMIT, LIMIT)], None, stored).errors[0]

    nominal, steady = ("", [0.3], ["missed"]), ("load", [0.29, 0.31], ["missed", "missed"])
    turning, blurred = ("traction", [0.05, 0.3], ["met", "missed"]), ("reading", [0.2], ["not resolved"])
    kept = found(nominal, steady)
    assert (kept.answer, kept.changed_by, kept.scanned_pct) == (Answer.MISSED, (), (0.29, 0.31))
    opened = found(nominal, steady, turning)
    assert (opened.answer, opened.changed_by, opened.sign_changed_by) == (
        Answer.NOT_RESOLVED, ("traction",), ("traction",)
    )  # fmt: skip
    vague = found(nominal, blurred)
    assert (vague.answer, vague.changed_by, vague.sign_changed_by) == (Answer.NOT_RESOLVED, ("reading",), ())
    assert found(nominal, turning, defect="inner").changed_by == ()  # another record's scan says nothing of this one


@pytest.mark.parametrize(("kind", "factor"), [("outer", 1.0), ("inner", (1 - RATIO) / RATIO)])
def test_the_rig_scene_is_stated_in_per_cent_of_the_cage_ratio(kind, factor):
    """Its study is in per cent of the line, BPFI is Z (1 - c): an error of the line there has the other sign."""
    study = {
        "of": {"record": "r", "kind": kind, "cage_ratio": RATIO}, "nominal": 1.001 * RATIO, "uncertainty_pct": 0.02,
    }  # fmt: skip
    (found,) = headline([], {"studies": [study, study | {"uncertainty_pct": None}]}, None).rig_scene
    assert found.error_pct == pytest.approx(0.1)
    assert found.uncertainty_pct == pytest.approx(0.02 * factor)
