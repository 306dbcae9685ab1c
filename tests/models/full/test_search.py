"""Fewer columns and fewer points looked at: nothing that touches may be missed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.frames_kernel import candidate_code, candidate_count
from srbval.models.full.parameters import Parameters, make_parameters
from srbval.models.full.search_kernel import points_of_group
from srbval.models.full.state import layout_of
from srbval.models.full.steps import rates, take_steps
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene

GEOMETRY = load_bearing("skf-22240").geometry
STEP_S = 1 / 61440
NO_CLEARANCE_M = 1e-30  # so that every roller within reach is given the widest window
# Points out of contact add zeros, but windows about another point turn the axes by another angle: rounding.
SAME = 1e-9
NOTHING = 1e-6  # N, W or J beside values of hundreds
SAME_STEPS, SAME_STEPS_SHARE = 1e-8, 1e-11  # the same after two steps; of the largest velocity
SCENES: dict[str, dict[str, Any]] = {
    "play 0, outer": {"defect": {"kind": "outer"}},
    "interference, inner": {"defect": {"kind": "inner"}, "contact": {"roller_fit": "printed"}},
    "dense": {"contact": {"points_per_circle": 3000, "stiffness": "5e6 N/m"}},
    "roller": {"defect": {"kind": "roller", "height": "0.05 mm", "extent": "2 mm"}},
}


def looking_at_all(model: Parameters) -> Parameters:
    """The same model with the widest windows for every roller within reach."""
    return model._replace(
        races=model.races._replace(
            outer=model.races.outer._replace(clearance=NO_CLEARANCE_M),
            inner=model.races.inner._replace(clearance=NO_CLEARANCE_M),
        )
    )


def shaken(model: Parameters, seed: int) -> np.ndarray:
    """A state about balance: rollers up to 60 um off, ring 40 um, cage tilted by up to 2 mrad, all moving."""
    rng = np.random.default_rng(seed)
    y = equilibrium_state(model).state.copy()
    layout = layout_of(y)
    n, cage, cage_rate = layout.rollers, layout.cage.start, layout.cage_rate.start
    y[layout.slide] += rng.uniform(-6e-5, 6e-5, n)
    y[layout.rotation] = rng.uniform(-3, 3, n)
    y[cage : cage + 2] += rng.uniform(-2e-3, 2e-3, 2)
    y[cage + 2] = rng.uniform(-3, 3)
    y[layout.ring] += rng.uniform(-4e-5, 4e-5, 3)
    y[layout.slide_rate] += rng.normal(0, 0.03, n)
    y[layout.shaft_cage_rate] *= rng.choice([1.0, -1.0, 4.0])  # rollers pass the races' points either way
    y[cage_rate : cage_rate + 2] += rng.normal(0, 0.05, 2)
    y[layout.ring_rate] += rng.normal(0, 0.02, 3)
    return y


@pytest.mark.parametrize("scene", SCENES)
def test_nothing_that_touches_is_missed(scene: str) -> None:
    assert GEOMETRY is not None
    model = make_parameters(paper_scene(**SCENES[scene]), GEOMETRY)
    everything = looking_at_all(model)
    for seed in range(40):
        y = shaken(model, seed)
        few, all_ = rates(model, 0.01 * seed, y), rates(everything, 0.01 * seed, y)
        assert few.load_n == pytest.approx(all_.load_n, abs=SAME * all_.load_n.max())
        assert few.rate == pytest.approx(all_.rate, rel=SAME, abs=SAME * np.abs(all_.rate).max())
        assert few.totals == pytest.approx(all_.totals, rel=SAME, abs=NOTHING)


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("solver", ["imex2", "ros2"])
def test_nothing_that_begins_to_touch_is_missed(scene: str, solver: str) -> None:
    """Implicit methods let an approaching point act a little before it touches."""
    assert GEOMETRY is not None
    model = make_parameters(paper_scene(**SCENES[scene]), GEOMETRY)
    everything = looking_at_all(model)
    for seed in range(20):
        few, all_ = shaken(model, seed), shaken(model, seed)
        for m, y in ((model, few), (everything, all_)):
            take_steps(m, y, METHODS[solver], step_s=STEP_S, intervals=2, first_interval=100 * seed)
        scale = np.abs(all_[layout_of(all_).half :]).max()
        assert few == pytest.approx(all_, rel=SAME_STEPS, abs=SAME_STEPS_SHARE * scale)


@pytest.mark.parametrize("onwards", [1.0, -1.0])
def test_window_holds_every_point_within_reach(onwards: float) -> None:
    """Counted out: points within one reach ahead of the roller, within another behind it."""
    rng = np.random.default_rng(0)
    for _ in range(5000):
        place, aside = rng.uniform(100, 101), rng.choice([0.0, 0.03])
        ahead, behind = np.sort(rng.uniform(-0.4, 2.5, 2))[::-1]
        count = candidate_count(
            np.sign(behind) * behind**2, np.sign(ahead) * ahead**2, aside, onwards * place, 9.0, None
        )  # fmt: skip
        k = np.arange(90, 112)
        further = onwards * (k - place)
        reached = k[(further <= max(ahead, 0) + aside) & (-further <= max(behind, 0) + aside) & (ahead > 0)]
        if len(reached) == 0:
            assert count <= 1
            continue
        middle = np.floor(place + 0.5) if count % 2 else np.floor(place)
        window = middle + np.arange(count) - (count - 1) // 2
        assert set(reached) <= set(window)
        assert count <= 2 * max(np.ceil(max(ahead, behind, 0) + aside), 1)


def test_a_lane_group_leaves_out_the_few_that_need_more() -> None:
    space = np.zeros(200_000)

    def best(candidates: list[int]) -> tuple[int, int]:
        code = 0.0
        for lane, own in enumerate(candidates):
            space[int(col.CANDIDATES) + lane], space[int(col.CANDIDATE_CODE) + lane] = own, candidate_code(float(own))
            code += candidate_code(float(own))
        found: tuple[int, int] = points_of_group(int(code), np.uint64(0), space)
        return found

    assert best([0, 0, 0, 1, 0, 0, 0, 0]) == (0, 1)
    assert best([1] * 8) == (1, 1)
    assert best([1, 1, 1, 1, 1, 1, 1, 2]) == (1, 2)
    assert best([2, 2, 2, 2, 1, 1, 1, 1]) == (2, 2)
    assert best([3, 3, 3, 3, 3, 3, 3, 3]) == (3, 3)
    assert best([9, 3, 3, 3, 3, 3, 3, 3]) == (3, 9)
