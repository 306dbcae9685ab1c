"""Axial load of 0 to 49 kN beside the rig's radial load: rows' shares with free and held rollers.

Reason: free rollers decide which row carries an axial load. Sources: a closed form, the approach of a roller linear in
the ring's displacements (T. A. Harris & M. N. Kotzalas, Essential Concepts of Bearing Technology, 2006, on combined
load) and a lamina's force integrated over the parabola of the gap.
"""

from functools import cache

import numpy as np
import pytest
from scipy.optimize import root
from scipy.special import hyp2f1

from srbval.models.full.equilibrium import equilibrium_state
from srbval.scene import load_scene
from tests.verification.harness import FloatArray, Parameters, geometry, rates
from tests.verification.slices_reference import C_L_N_MM, slices_model

RADIAL_N, OSCULATION, PLAY_MM = 124.8e3, 0.97, 0.04555
AXIAL_N = (0.0, 12.5e3, 25e3, 49e3)
AT_REST = {"contact": {"static_friction": 0.0, "dynamic_friction": 0.0}, "line_contact": {"traction": "dry"},
           "shaft_speed": "1e-6 rpm"}  # fmt: skip
SHARE, LEAST_SHARE = 0.03, 2e-3  # of a share, or of all load: the closed form leaves out that contact angles change
LOADS = 2e-3  # of the largest: what the theory states of held rollers without axial load


@cache
def in_balance(axial_n: float, free: bool = True) -> tuple[Parameters, FloatArray]:
    """The model, and the loads of its outer contacts in balance, [2 rows, M] [N]."""
    load = {"radial_n": RADIAL_N, "axial_n": axial_n, "gravity": False}
    model = slices_model(load_scene("rig", AT_REST | {"bodies": {"free_rollers": free}, "load": load}))
    return model, rates(model, 0.0, equilibrium_state(model)).load_n[0].sum(axis=1).reshape(2, -1)


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
    model, load_n = in_balance(axial_n)
    shares = load_n.sum(axis=1) / load_n.sum()
    assert shares == pytest.approx(closed_form_shares(model, axial_n), rel=SHARE, abs=LEAST_SHARE)


def test_without_axial_load_held_rollers_carry_what_free_ones_do() -> None:
    held, free = (in_balance(0.0, free)[1] for free in (False, True))
    assert np.abs(held - free).max() < LOADS * held.max()
    assert np.abs(in_balance(25e3, False)[1] - in_balance(25e3)[1]).max() > 10 * LOADS * held.max()
