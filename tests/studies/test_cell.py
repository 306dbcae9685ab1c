"""Status of a cell, on synthetic outcomes: the run's own status first, the comparison second."""

from __future__ import annotations

import math
from typing import Any

import pytest
from srbval.studies.stability.outcome import StabilityOutcome, StabilityReference

from srbval.models.step_error import BLOCKS
from srbval.studies.stability.cell import UNLIKE, StabilityCell, planted_in
from srbval.studies.stability.claims import claims
from srbval.studies.stability.grid import StabilityCase, StabilityGroup
from srbval.studies.stability.step_limits import StepLimits


def outcome(**changes: Any) -> StabilityOutcome:
    given: dict[str, Any] = {
        "status": "ok", "reason": "well", "cage_ratio": 0.4314, "load_share": 0.06, "band_rms_m_s2": 1.0,
        "energy_imbalance": 0.0, "seconds": 0.2, "settle_s": 0.02, "wall_s": 0.1,
    }  # fmt: skip
    return StabilityOutcome(**given | changes)


def cell(
    *,
    solver: str = "ode4",
    steps_per_s: int = 61440,
    rpm: float = 710.0,
    converged: StabilityOutcome | None = None,
    **own: Any,
) -> StabilityCell:
    group = StabilityGroup(scene="play0-outer", rpm=rpm, critical_velocity_m_s=0.001)
    right = converged or outcome()
    return StabilityCell(
        case=StabilityCase(group=group, solver=solver, steps_per_s=steps_per_s),
        model="full",
        outcome=outcome(**own),
        reference=StabilityReference(
            group=group, solver="imex2", steps_per_s=983040, fine=right, coarse=right
        ),
        limits=StepLimits(whole_s=1e-7, elastic_s=1e-4),
        points_per_step=0.2,
    )  # fmt: skip


def test_a_run_like_the_converged_one_is_ok() -> None:
    good = cell(cage_ratio=0.4314 * 1.009, load_share=0.06 * 0.96)
    assert (good.status, good.reason, good.ok, good.stable) == ("ok", "well", True, True)


@pytest.mark.parametrize(
    ("name", "change"), [("mean cage speed", 1e-4), ("RMS in 500-1500 Hz", 0.2), ("drive power", -0.1)]
)
def test_what_is_beyond_a_tolerance_is_inaccurate_and_still_stable(name: str, change: float) -> None:
    means = {"mean cage speed": 30.0, "RMS in 500-1500 Hz": 4.0, "drive power": 7e3}
    right = outcome(means={of: [mean] * BLOCKS for of, mean in means.items()})
    for off, status in ((change, "inaccurate"), (0.01 * change, "ok")):
        wrong = {of: [mean * (1 + off) if of == name else mean] * BLOCKS for of, mean in means.items()}
        found = cell(converged=right, means=wrong)
        assert (found.status, found.ok, found.stable) == (status, status == "ok", True)
    both = {"means": {name: [1.0 + change] * BLOCKS}, "status": "skidding"}
    theirs = outcome(means={name: [1.0] * BLOCKS}, status="skidding")
    assert cell(converged=theirs, **both).ok == (name == "mean cage speed"), "one that slides is told to a per cent"
    chance = [times * means[name] for _ in range(BLOCKS // 4) for times in (0.0, 0.0, 2.4, 2.4)]
    assert cell(converged=right, means={name: chance}).ok, "blocks that say so different things say nothing"


@pytest.mark.parametrize(
    "wrong",
    [
        {"cage_ratio": 0.4314 * 1.011},
        {"cage_ratio": 0.4314 * 0.989},
        {"load_share": 0.06 * 0.94},
        {"load_share": 0.06 * 1.11},
        {"load_share": math.nan},
        {"cage_ratio": math.nan},
    ],
)
def test_what_the_comparison_alone_sees_has_a_word_of_its_own(wrong: dict[str, float]) -> None:
    silent = cell(**wrong)
    assert silent.outcome.ok
    assert silent.status == UNLIKE
    assert "own tests passed" in silent.reason
    assert not silent.stable


def test_a_slow_cage_that_the_converged_run_has_too_is_no_failure() -> None:
    slow = {"status": "skidding", "cage_ratio": 0.36, "load_share": 1e-4}
    both = cell(converged=outcome(**slow), **(slow | {"load_share": -2e-4}))
    assert (both.status, both.ok, both.stable, both.reference.flagged) == ("skidding", True, True, False)
    alone = cell(**slow)
    assert (alone.status, alone.stable) == (UNLIKE, False)
    assert cell(converged=outcome(**slow)).status == UNLIKE


def test_the_run_s_own_word_comes_first() -> None:
    lost = cell(status="load-lost", reason="the rollers carry 0 %", load_share=0.0)
    assert (lost.status, lost.reason, lost.stable) == ("load-lost", "the rollers carry 0 %", False)


def test_energy_that_does_not_close_is_not_ok_but_may_be_stable() -> None:
    chatters = cell(status="energy-open", reason="energy")
    assert (chatters.status, chatters.ok, chatters.stable) == ("energy-open", False, True)
    assert not cell(status="energy-open", reason="energy", load_share=0.03).stable


def test_nothing_is_ok_beside_a_failed_reference() -> None:
    assert cell(converged=outcome(status="too-deep")).status == "no-reference"


def test_planted_failures_are_found_by_solver_step_and_speed() -> None:
    cells = [
        cell(solver="ode1", steps_per_s=30720, status="too-deep"),
        cell(solver="ode2", steps_per_s=15360),
        cell(solver="ode2", steps_per_s=30720, status="too-deep"),
        cell(solver="ode1", steps_per_s=30720, rpm=355.0, status="too-deep"),
    ]
    assert [p.caught for p in planted_in(cells)] == [True, False]


def grid(bad: dict[tuple[str, float], str]) -> list[StabilityCell]:
    return [
        cell(solver=solver, rpm=rpm, status=bad.get((solver, rpm), "ok"))
        for solver in ("ode1", "ode2", "ode3", "ode4")
        for rpm in (710.0, 3000.0)
    ]


def test_the_lowest_order_is_counted() -> None:
    order, _ = claims(grid({("ode1", 710.0): "load-lost"}))
    assert order.borne_out is False
    assert order.answer.startswith(
        "No: the lowest order that is stable in every cell at 1/61440 s up to 1000 rpm is ode2"
    )
    assert any("load-lost at 710 rpm" in line for line in order.evidence)
    lower = {(f"ode{n}", 710.0): "too-deep" for n in (1, 2, 3)}
    assert claims(grid(lower))[0].borne_out is True
    assert claims(grid({**lower, ("ode4", 710.0): "too-deep"}))[0].borne_out is False


def test_what_fails_above_1000_rpm_is_named() -> None:
    _, speed = claims(grid({("ode1", 3000.0): "too-deep"}))
    assert speed.borne_out is False
    assert "ode1 at 1/61440 s (too-deep at 3000 rpm)" in speed.answer
    assert claims(grid({("ode4", 3000.0): "too-deep"}))[1].borne_out is True
    faster = claims([*grid({}), cell(solver="ode4", rpm=6000.0, status="too-deep")])[1]
    assert (faster.borne_out, faster.answer[:17]) == (False, "Only at 6000 rpm:")
    assert claims(grid({("ode4", 3000.0): "too-deep", ("ode4", 710.0): "too-deep"}))[1].borne_out is False


def test_cells_that_do_not_cover_a_claim_say_so() -> None:
    order, speed = claims([cell(solver="imex2")])
    assert (order.borne_out, speed.borne_out) == (None, None)
    assert "do not cover" in order.answer
    assert "do not cover" in speed.answer
