"""Table 6's printed values; verdicts on the cage ratio: each answer is reached; bias and scatter by record."""

from typing import Any

import numpy as np
import pytest

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.cage_means import cage_means
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.compared_quantities import HARMONIC, MIN_RECORDS_FOR_BIAS, biases
from srbval.comparison.comparison import (
    RIG_READING,
    TOLERANCE,
    QuantityValue,
    Row,
    Verdict,
    comparison_frame,
    comparison_row,
    deviation_pct,
    verdict_on_tolerance,
)
from srbval.comparison.table6 import check_race_sum, table6
from srbval.comparison.verdicts import endpoints, none_missed, verdicts
from srbval.signal import NORMAL_95

LIMIT = TOLERANCE.limit_pct
RATIO = 0.431  # of a cage over its shaft
STATES, SPEEDS = (Fault.HEALTHY, *RACE_DEFECTS, Fault.ROLLER), (353.0, 877.0)
LEVEL, TREND, RACES = range(3)
NAMES = ("877 rpm", "353 less 877 rpm", "OR less IR")
WITHIN = 0.1 * LIMIT  # of an error, beside the one planted: what few records leave


def readings(slow_pct: float = 0.0, outer_pct: float = 0.0) -> list[CageReading]:
    """Eight precise records, by how much the slow ones and those of the outer race are higher."""

    def one(rpm: float, state: Fault) -> CageReading:
        ratio = RATIO * (1 + (slow_pct * (rpm == SPEEDS[0]) + outer_pct * (state is Fault.OUTER)) / 100)
        about: dict[str, Any] = {"record": f"{state.code} {rpm:g}", "read_from": "BPFO", "band_hz": (1.0, 2.0)}
        about |= {"state": state, "nominal_rpm": rpm, "shaft_rpm": rpm, "per_speed": -RATIO}
        return CageReading(ratio=ratio, reading_u=1e-6, speed_u=1e-6, **about)

    return [one(rpm, state) for rpm in SPEEDS for state in STATES]


def variant(
    off_pct: float = 0.0, *, half_pct: float = 0.01, slow_pct: float = 0.0, reach_pct: float = 0.0, scene: str = "rig"
) -> dict[str, Any]:
    """One whose draws lie evenly within `half_pct` about `off_pct`, at slow records `slow_pct` higher.

    Its first input makes none of that but, alone, moves the ratio by up to `reach_pct` either way.
    """
    at = np.linspace(0, 1, 41)

    def ratios(rpm: float, drawn: Any) -> list[float]:
        return (RATIO * (1 + (off_pct + slow_pct * (rpm == SPEEDS[0]) + drawn) / 100)).tolist()

    own = {"scene": scene, "at": np.column_stack((np.full(at.size, 0.5), at)).tolist()}
    records = [(state, rpm) for rpm in SPEEDS for state in (Fault.HEALTHY, *RACE_DEFECTS)]
    spread = half_pct * (2 * at - 1)
    moved, shares, ends = {"reach": reach_pct, "spread": half_pct}, [0.0, 0.5, 1.0], np.array([-1.0, 0.0, 1.0])
    return own | {
        "records": [
            {"state": state.value, "nominal_rpm": rpm, "drawn": ratios(rpm, spread)}
            | dict.fromkeys(("nominal", "finer"), ratios(rpm, np.zeros(1))[0])
            for state, rpm in records
        ],
        "effects": [
            {"name": name, "shares": shares, "ratios": [ratios(rpm, by * ends) for _, rpm in records]}
            for name, by in moved.items()
        ],
    }


def found(read: list[CageReading], *variants: dict[str, Any]) -> list[Row]:
    return verdicts(read, cage_means(read), {"variants": variants})


@pytest.mark.parametrize(
    ("off", "half", "answer"),
    [
        (0.0, 0.1, Verdict.MET),
        (1.0, 0.3, Verdict.NOT_RESOLVED),
        (2.0, 0.1, Verdict.MISSED),
        (-2.0, 0.1, Verdict.MISSED),
        (0.0, 1.5, Verdict.NOT_RESOLVED),
    ],
)
def test_each_answer_is_reached_at_one_speed(off: float, half: float, answer: Verdict) -> None:
    one = found(readings(), variant(off * LIMIT, half_pct=half * LIMIT))[LEVEL]
    assert one["verdict"] == answer
    assert one["error_pct"] == pytest.approx(off * LIMIT, abs=WITHIN)
    assert one["u_pct"] > 0.9 * half * LIMIT


@pytest.mark.parametrize("sign", [-1, 1])
def test_what_is_common_to_all_speeds_cancels_in_the_trend(sign: int) -> None:
    """With inputs that leave the level open the trend is missed, or met; the error is the model's less the rig's."""
    wide = {"half_pct": 3 * LIMIT}
    missed = found(readings(slow_pct=sign * 2 * LIMIT), variant(**wide))
    assert (missed[LEVEL]["verdict"], missed[TREND]["verdict"]) == (Verdict.NOT_RESOLVED, Verdict.MISSED)
    assert missed[TREND]["error_pct"] == pytest.approx(-sign * 2 * LIMIT, abs=WITHIN)
    assert found(readings(), variant(**wide))[TREND]["verdict"] == Verdict.MET
    of_model = found(readings(), variant(slow_pct=sign * 2 * LIMIT, **wide))[TREND]
    assert (of_model["verdict"], np.sign(of_model["error_pct"])) == (Verdict.MISSED, sign)


def test_the_races_are_compared_at_the_same_speed() -> None:
    one = found(readings(slow_pct=5 * LIMIT, outer_pct=3 * LIMIT), variant())[RACES]
    assert one["error_pct"] == pytest.approx(-3 * LIMIT, abs=WITHIN)
    assert (one["records"], one["verdict"]) == (4, Verdict.MISSED)


def test_only_an_input_that_reverses_the_answer_takes_it_back() -> None:
    """Missed at twice the limit: an input that alone reaches the middle of it does, one that only blurs it does not."""
    blurred = found(readings(), variant(2 * LIMIT, reach_pct=0.9 * LIMIT))[LEVEL]
    assert (blurred["verdict"], blurred["reversed_by"]) == (Verdict.MISSED, [])
    reversed_ = found(readings(), variant(2 * LIMIT, reach_pct=2 * LIMIT))[LEVEL]
    assert (reversed_["verdict"], reversed_["reversed_by"]) == (Verdict.NOT_RESOLVED, ["reach"])
    assert verdict_on_tolerance(reversed_["p_beyond"], TOLERANCE.risk) is Verdict.MISSED


def test_each_scene_has_its_own_verdict_and_one_that_is_missed_does_not_hold() -> None:
    rows = found(readings(), variant(), variant(2 * LIMIT, scene="paper"))
    assert [one["scene"] for one in rows] == ["rig"] * 3 + ["paper"] * 3
    assert (rows[LEVEL]["verdict"], rows[3 + LEVEL]["verdict"]) == (Verdict.MET, Verdict.MISSED)
    assert none_missed(rows[:3])
    assert not none_missed(rows)


def test_endpoints_are_those_that_the_records_allow() -> None:
    def names(read: list[CageReading]) -> tuple[str, ...]:
        return tuple(one.name for one in endpoints(read, cage_means(read)))

    assert names(readings()) == NAMES
    assert names([one for one in readings() if one.nominal_rpm == SPEEDS[1]]) == (NAMES[LEVEL], NAMES[RACES])
    assert names([one for one in readings() if one.state not in RACE_DEFECTS]) == NAMES[:RACES]
    assert verdicts(readings(), cage_means(readings()), {}) == []


# Three standard errors of mean and standard deviation of 4000 errors that scatter by 1.8; the data's is exact.
MEAN_DB, SCATTER_RELATIVE, DATA_RELATIVE = 0.1, 0.05, 1e-4


def row(error, record, data=1.0, kind=HARMONIC[2].kind, **changes):
    sides = {"model": QuantityValue(value=error), "rig": QuantityValue(value=0.0)}
    names = {"kind": kind, "quantity": "q", "unit": "dB", "error_unit": "dB", "record": str(record), "scene": "rig"}
    parts = {RIG_READING: NORMAL_95 * data}
    return comparison_row(state=Fault.INNER, error=error, parts=parts, **names | sides | changes)


def found_biases(rows, **columns):
    return biases(comparison_frame(rows).assign(**columns))


@pytest.mark.parametrize(("bias", "scatter"), [(-2.0, 1.5), (0.0, 0.0)])
def test_scatter_of_the_data_is_not_the_model_s(bias, scatter):
    rng = np.random.default_rng(1)
    errors = bias + scatter * rng.standard_normal(4000) + rng.standard_normal(4000)
    (found,) = found_biases([row(error, i) for i, error in enumerate(errors)])
    assert found["bias"] == pytest.approx(bias, abs=MEAN_DB)
    assert found["scatter"] == pytest.approx(scatter, rel=SCATTER_RELATIVE, abs=0.3)
    assert found["data_scatter"] == pytest.approx(1.0, rel=DATA_RELATIVE)


def test_fewer_than_five_records_claim_nothing_however_many_numbers_they_hold():
    few = [row(1.0, record) for record in range(MIN_RECORDS_FOR_BIAS - 1) for _ in range(10)]
    (found,) = found_biases(few)
    assert (found["records"], found["bias"], found["ci95"], found["scatter"]) == (4, None, None, None)
    (found,) = found_biases([*few, row(1.0, "one more")])
    assert (found["records"], found["bias"]) == (5, 1.0)


def test_student_s_interval_over_records():
    """Five records: t(4) = 2.776 of Student's table."""
    (found,) = found_biases([row(e, i) for i, e in enumerate((1.0, 2.0, 3.0, 4.0, 5.0))])
    assert found["ci95"] == pytest.approx(2.776445 * np.std([1, 2, 3, 4, 5], ddof=1) / np.sqrt(5), rel=1e-6)


def test_rows_are_pooled_by_kind_scene_and_use_and_never_across():
    unseen = row(99.0, "c", rig=QuantityValue(value=0.0, present=False))
    few = [row(1.0, "a"), row(3.0, "a"), row(-4.0, "b"), unseen]
    more = [row(8.0, "d", used_for="fit"), row(7.0, "a", scene="paper"), row(1.0, "a", kind=HARMONIC[3].kind)]
    withheld, fit, paper, other = found_biases([*few, *more])
    assert withheld.items() >= {"scene": "rig", "used_for": "withheld", "records": 2, "pairs": 3}.items()
    assert withheld["mean_error"] == pytest.approx(-1.0)  # of the records' means, 2 and -4
    assert (fit["used_for"], fit["mean_error"], paper["scene"], other["kind"]) == ("fit", 8.0, "paper", "harmonic 3")
    (pooled,) = found_biases([row(1.0, "a"), row(2.0, "b", used_for="blind")], used_for="withheld")
    assert (pooled["used_for"], pooled["records"]) == ("withheld", 2)


PRINTED_PCT = 0.01  # the paper prints its deviations with one or two digits, and 0.226 as 0.22
ROUNDING_PCT = 1e-12  # sums of exact numbers


def test_printed_deviations_are_those_of_the_printed_frequencies() -> None:
    for row in table6().values():
        assert deviation_pct(row.model_hz, row.kinematic_hz) == pytest.approx(row.model_printed_pct, abs=PRINTED_PCT)
        assert deviation_pct(row.rig_hz, row.kinematic_hz) == pytest.approx(row.rig_printed_pct, abs=PRINTED_PCT)


def test_the_sum_is_blind_to_slip_sees_speed_and_closes_within_its_uncertainty() -> None:
    def pair(bpfo_hz: float, bpfi_hz: float, ci95: float | None = None) -> dict[str, Any]:
        """Both race lines of 19 rollers, read at 600 rpm."""
        return check_race_sum("made", "simulated", 19, (bpfo_hz / 10, bpfi_hz / 10), ci95, 600.0)

    exact, slipped, slower = pair(81.0, 109.0), pair(80.0, 110.0), pair(80.19, 107.91)
    assert (exact["difference_pct"], slipped["difference_pct"]) == pytest.approx((0.0, 0.0), abs=ROUNDING_PCT)
    assert slower["implied_rpm"] == pytest.approx(0.99 * 600)
    orders = [row.rig_hz / (row.rpm / 60) for row in table6().values()]  # -1 % of the inner race is speed, not slip
    of_paper = check_race_sum("paper's rig", "published", 19, orders, None, 710.0)
    assert of_paper["implied_rpm"] == pytest.approx(706.6, abs=0.05)
    assert exact["closed"] is None
    assert [pair(81.01, 109.0, ci95)["closed"] for ci95 in (0.005, 0.0005)] == [True, False]
