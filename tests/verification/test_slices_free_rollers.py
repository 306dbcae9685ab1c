"""Axial load of 0 to 49 kN beside the rig's radial load: rows' shares, ring, tilt and cage, with free and held rollers.

Reason: free rollers decide which row carries an axial load. Sources: a closed form, the approach of a roller linear in
the ring's displacements (T. A. Harris & M. N. Kotzalas, Essential Concepts of Bearing Technology, 2006, on combined
load) and a lamina's force integrated over the parabola of the gap; and ISO/TS 16281's rollers of `test_free_rollers`.
"""

from functools import cache
from typing import NamedTuple

import numpy as np
import pytest
from scipy.optimize import root
from scipy.special import hyp2f1

from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.scene import load_scene
from tests.verification.harness import FloatArray, Parameters, geometry, layout_of, rates
from tests.verification.slices_reference import C_L_N_MM, slices_model
from tests.verification.test_free_rollers import Pose, StaticRoller, in_order

RADIAL_N, OSCULATION, PLAY_MM = 124.8e3, 0.97, 0.04555
AXIAL_N = (0.0, 12.5e3, 25e3, 49e3)
AT_REST = {"contact": {"static_friction": 0.0, "dynamic_friction": 0.0}, "line_contact": {"traction": "dry"},
           "shaft_speed": "1e-6 rpm"}  # fmt: skip
SHARE, LEAST_SHARE = 0.03, 2e-3  # of a share, or of all load: the closed form leaves out that contact angles change
STATIC = 2e-3  # of displacement, tilt and shift: a slice's mean over its width
# What the theory states of held rollers without axial load: loads off by this, of the largest one, cage slower by this.
LOADS, RATIO = 2e-3, 3e-4


class Balanced(NamedTuple):
    """The model, its state in balance, and the loads of the outer contacts, [2 rows, M] [N]."""

    model: Parameters
    state: FloatArray
    load_n: FloatArray


@cache
def in_balance(axial_n: float, free: bool = True) -> Balanced:
    load = {"radial_n": RADIAL_N, "axial_n": axial_n, "gravity": False}
    model = slices_model(load_scene("rig", AT_REST | {"bodies": {"free_rollers": free}, "load": load}))
    state = equilibrium_state(model)
    return Balanced(model, state, rates(model, 0.0, state).load_n[0].sum(axis=1).reshape(2, -1))


def closed_form_shares(model: Parameters, axial_n: float) -> FloatArray:
    """Of both rows: Q = c_L / L (integral of (delta - kappa x^2)^(10/9) over the contact), mm and N."""
    g, angle = geometry(), model.slot_angle - np.pi / 2  # from the middle of the load zone, y: the ring moves down
    cosine, sine = np.cos(g.tilt_rad), -np.sin(g.tilt_rad) * np.repeat([1.0, -1.0], len(angle) // 2)
    half, bend = 500 * g.roller_width_m, (1 / OSCULATION - 1) / (1e3 * g.raceway_radius_m)

    def loads(moved_mm: FloatArray) -> FloatArray:
        delta = np.maximum(moved_mm[0] * cosine * np.cos(angle) + moved_mm[1] * sine - PLAY_MM, 1e-12)
        end = np.minimum(half, np.sqrt(delta / bend))
        integral = 2 * end * delta ** (10 / 9) * hyp2f1(-10 / 9, 0.5, 1.5, np.minimum(bend * end**2 / delta, 1 - 1e-12))
        found: FloatArray = C_L_N_MM * (2 * half) ** (8 / 9) / (2 * half) * integral
        return found

    def left(moved_mm: FloatArray) -> FloatArray:
        q = loads(moved_mm)
        return np.array([(q * cosine * np.cos(angle)).sum() - RADIAL_N, (q * sine).sum() - axial_n]) / RADIAL_N

    solved = root(left, np.array([0.1, 0.5 * axial_n / 49e3]))
    assert np.abs(solved.fun).max() < 1e-9, solved.message
    rows: FloatArray = loads(solved.x).reshape(2, -1).sum(axis=1)
    return rows / rows.sum()


@pytest.mark.parametrize("axial_n", AXIAL_N)
def test_shares_of_the_rows_are_those_of_the_closed_form(axial_n: float) -> None:
    found = in_balance(axial_n)
    shares = found.load_n.sum(axis=1) / found.load_n.sum()
    assert shares == pytest.approx(closed_form_shares(found.model, axial_n), rel=SHARE, abs=LEAST_SHARE)


@pytest.mark.parametrize("axial_n", AXIAL_N)
def test_displacement_and_tilt_are_those_of_the_standards_rollers(axial_n: float) -> None:
    """Ring, slides, shifts and tilts all by root finding, from a guess of the ring that the model has no part in."""
    found = in_balance(axial_n)
    model, rollers = found.model, len(found.model.slot_angle)

    def poses(ring_um: FloatArray) -> list[Pose]:
        ring = np.array([0.0, *(1e-6 * ring_um)])
        return [StaticRoller(model, number, ring, OSCULATION).balance() for number in range(rollers)]

    def left(ring_um: FloatArray) -> FloatArray:
        g = geometry()
        f_s, f_x = np.transpose([p.on_roller_n for p in poses(ring_um)])
        radial = (f_s * np.cos(g.tilt_rad) - f_x * np.sin(g.tilt_rad)) * np.sin(model.slot_angle)
        along = (f_s * np.sin(g.tilt_rad) + f_x * np.cos(g.tilt_rad)) * np.repeat([1.0, -1.0], rollers // 2)
        return np.array([-RADIAL_N, axial_n]) - [radial.sum(), along.sum()]

    solved = root(left, np.array([-100.0 + axial_n / 700, axial_n / 150]), tol=1e-6, options={"eps": 1e-8})
    assert np.abs(solved.fun).max() < 1.0, solved.message
    ring = 1e6 * found.state[layout_of(found.state).ring][1:]
    assert ring == pytest.approx(solved.x, abs=STATIC * np.abs(solved.x).max())
    expected, side = poses(solved.x), np.repeat([1.0, -1.0], rollers // 2)
    loaded = found.load_n.ravel() > 0.05 * found.load_n.max()
    for row, pose in (
        (col.TILT_SINE, [p.tilt_rad for p in expected]),
        (col.SHIFT_ALONG, [p.axial_m for p in expected]),
    ):
        in_model, known = in_order(model, row)[loaded], (side * pose)[loaded]
        assert in_model == pytest.approx(known, abs=STATIC * np.abs(known).max() + 1e-9)


def test_without_axial_load_held_rollers_carry_what_free_ones_do() -> None:
    held, free = (in_balance(0.0, free).load_n for free in (False, True))
    assert np.abs(held - free).max() < LOADS * held.max()
    assert np.abs(in_balance(25e3, False).load_n - in_balance(25e3).load_n).max() > 10 * LOADS * held.max()


def test_the_cage_is_a_little_faster_with_free_rollers() -> None:
    """Their contacts lie in the rollers' middles; held ones slide more. At a run's start, friction balanced."""
    held, free = (
        equilibrium_state(slices_model(load_scene("rig", {"bodies": {"free_rollers": free}}))) for free in (False, True)
    )
    cage = layout_of(held).shaft_cage_rate
    assert 0 < float(free[cage][0] / held[cage][0]) - 1 < RATIO
