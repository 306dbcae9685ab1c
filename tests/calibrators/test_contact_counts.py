"""Costs by points and by points in contact, counted a second time from geometry, independent of the kernels."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from srbval.bench.scenes import QUICK, bench_scene
from srbval.bench.timing import attempt
from srbval.models.run import Run
from tests.calibrators.contact_cost import (
    NOTHING_TOUCHES,
    ContactCost,
    contact_cost_ratio,
    contact_costs,
    points_growth,
)
from tests.calibrators.contact_counts import count_contacts, point_depths

# Damping and friction are left out of the second look, so the mean loads differ by some per cent. With play the rollers
# bounce: the load at an instant differs by 40 %, its mean over the moments looked at by a tenth of that.
SAME_LOAD = {"play0-healthy": 0.15, "interference-healthy": 0.05}


def run_of(name: str) -> Run:
    tried = attempt(bench_scene(name, solver="ode4", seconds=0.06, settle_s=0.04))
    assert tried.run is not None
    return tried.run


@pytest.mark.parametrize("name", ["play0-healthy", "interference-healthy"])
def test_elastic_forces_add_up_to_the_load(name: str) -> None:
    run = run_of(name)
    moments = range(0, len(run.cage_rad_s), 10)
    pushes = []
    for moment in moments:
        outer = np.maximum(point_depths(run, moment)[0], 0).sum(axis=(1, 2)) * run.scene.contact.stiffness_n_m
        time_s = run.scene.settle_s + (moment + 1) / run.scene.output_rate_hz
        angle = float(run.cage_rad_s.mean()) * time_s + np.tile(np.arange(19) * 2 * math.pi / 19, 2)
        pushes.append(float(np.sum(outer * np.sin(angle)) * math.cos(math.radians(10.0))))
    expected = float(run.roller_force_n[list(moments), 1].mean())
    assert np.mean(pushes) == pytest.approx(expected, rel=SAME_LOAD[name])


def test_counts() -> None:
    every, some = count_contacts(run_of("interference-healthy")), count_contacts(run_of("play0-healthy"))
    assert (every.loaded_rollers, every.contacts) == (38.0, 76.0)
    assert some.loaded_rollers < some.contacts < every.contacts
    assert 3 * every.contacts < every.points
    assert some.points < every.points / 2


def test_growth_is_of_time_per_touching_thing() -> None:
    def cost(scene: str, points: int, us: float, touching: float, contacts: float) -> ContactCost:
        return ContactCost(scene=scene, solver="ode4", points_per_circle=points, us_per_step=us,
                           touching_points=touching, touching_contacts=contacts)  # fmt: skip

    costs = [cost("play0-healthy", 500, 10.0, 100.0, 50.0), cost("play0-healthy", 4000, 40.0, 800.0, 50.0),
             cost("interference-healthy", 500, 20.0, 300.0, 80.0),
             cost(NOTHING_TOUCHES, 500, 4.0, 0.0, 0.0)]  # fmt: skip
    assert points_growth(costs) == pytest.approx(0.5)
    assert contact_cost_ratio(costs) == pytest.approx((6.0 / 50) / (16.0 / 80))
    assert contact_cost_ratio(costs[:3]) is None
    assert points_growth(costs[:1]) is None


def test_costs_are_measured_where_more_points_touch() -> None:
    settings = replace(QUICK, timing_s=0.002, timing_settle_s=0.0, repeats=1)
    costs = contact_costs("ode4", settings)
    assert [c.points_per_circle for c in costs] == [500, 1000, 2000, 4000, 500, 500]
    few, many = costs[0].touching_points, costs[3].touching_points
    assert few is not None
    assert many is not None
    assert few < many
