"""The second look at what touches agrees with the forces that the kernels computed."""

from __future__ import annotations

import math

import numpy as np
import pytest

from srbval.bench.contact_counts import count_contacts, point_depths
from srbval.bench.scenes import bench_scene
from srbval.bench.timing import attempt
from srbval.models.run import Run

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
