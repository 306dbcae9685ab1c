"""Fewer columns and fewer points looked at: nothing that touches may be missed."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.frames_kernel import need_of, touched_points
from srbval.models.full.parameters import Parameters, make_parameters
from srbval.models.full.search_kernel import worth_keeping
from srbval.models.full.steps import rates, take_steps
from srbval.models.solvers import METHODS
from srbval.scene import paper_scene

GEOMETRY = load_bearing("skf-22240").geometry
STEP_S = 1 / 61440
SCENES: dict[str, dict[str, Any]] = {
    "play 0, outer": {"defect": {"kind": "outer"}},
    "interference, inner": {"defect": {"kind": "inner"}, "contact": {"roller_fit": "printed"}},
    "dense": {"contact": {"points_per_circle": 3000, "stiffness": "5e6 N/m"}},
    "roller": {"defect": {"kind": "roller", "height": "0.05 mm", "extent": "2 mm"}},
}


def looking_at_all(model: Parameters) -> Parameters:
    """The same model with the widest windows for every roller within reach."""
    return model._replace(races=model.races._replace(outer_aside=1e-30, inner_aside=1e-30))


def shaken(model: Parameters, seed: int) -> np.ndarray:
    """A state about balance: rollers up to 60 um off, ring 40 um, cage tilted by up to 2 mrad, all moving."""
    rng = np.random.default_rng(seed)
    y = equilibrium_state(model).state.copy()
    n = len(model.slot_angle)
    d = 2 * n + 6
    y[:n] += rng.uniform(-6e-5, 6e-5, n)
    y[n : 2 * n] = rng.uniform(-3, 3, n)
    y[2 * n : 2 * n + 2] += rng.uniform(-2e-3, 2e-3, 2)
    y[2 * n + 2] = rng.uniform(-3, 3)
    y[2 * n + 3 : d] += rng.uniform(-4e-5, 4e-5, 3)
    y[d : d + n] += rng.normal(0, 0.03, n)
    y[d + 2 * n + 2] *= rng.choice([1.0, -1.0, 4.0])  # rollers pass the races' points either way
    y[d + 2 * n : d + 2 * n + 2] += rng.normal(0, 0.05, 2)
    y[d + 2 * n + 3 :] += rng.normal(0, 0.02, 3)
    return y


@pytest.mark.parametrize("scene", SCENES)
def test_nothing_that_touches_is_missed(scene: str) -> None:
    assert GEOMETRY is not None
    model = make_parameters(paper_scene(**SCENES[scene]), GEOMETRY)
    everything = looking_at_all(model)
    for seed in range(40):
        y = shaken(model, seed)
        few, all_ = rates(model, 0.01 * seed, y), rates(everything, 0.01 * seed, y)
        assert few.load_n == pytest.approx(all_.load_n, abs=1e-9 * all_.load_n.max())
        assert few.rate == pytest.approx(all_.rate, rel=1e-9, abs=1e-9 * np.abs(all_.rate).max())
        assert few.contact == pytest.approx(all_.contact, rel=1e-9, abs=1e-6)


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
        scale = np.abs(all_[len(all_) // 2 :]).max()
        assert few == pytest.approx(all_, rel=1e-8, abs=1e-11 * scale)


@pytest.mark.parametrize("onwards", [1.0, -1.0])
def test_window_holds_every_point_within_reach(onwards: float) -> None:
    """Counted out: points within one reach ahead of the roller, within another behind it."""
    rng = np.random.default_rng(0)
    for _ in range(5000):
        place, aside = rng.uniform(100, 101), rng.choice([0.0, 0.03])
        ahead, behind = np.sort(rng.uniform(-0.4, 2.5, 2))[::-1]
        count = touched_points(
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


def test_an_eight_leaves_out_the_few_that_need_more() -> None:
    space = np.zeros(200_000)
    from srbval.models.full.columns import NEED, TOUCHED

    def kept(touched: list[int]) -> tuple[int, int]:
        need = 0.0
        for lane, own in enumerate(touched):
            space[int(TOUCHED) + lane], space[int(NEED) + lane] = own, need_of(float(own))
            need += need_of(float(own))
        found: tuple[int, int] = worth_keeping(int(need), np.uint64(0), space)
        return found

    assert kept([0, 0, 0, 1, 0, 0, 0, 0]) == (0, 1)
    assert kept([1] * 8) == (1, 1)
    assert kept([1, 1, 1, 1, 1, 1, 1, 2]) == (1, 2)
    assert kept([2, 2, 2, 2, 1, 1, 1, 1]) == (2, 2)
    assert kept([3, 3, 3, 3, 3, 3, 3, 3]) == (3, 3)
    assert kept([9, 3, 3, 3, 3, 3, 3, 3]) == (3, 9)
