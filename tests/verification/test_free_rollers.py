"""Rollers that tilt and slide along their axes: each in balance, power closed, against an independent static solver.

Reason: a wrong sign of tilt, shift or of what follows from them would move load from row to row or make power. Source:
ISO/TS 16281, laminae fixed to the roller, q = c_L / L (approach of both contacts)^(10/9), half of the approach each;
slide, shift and tilt of every roller from its two forces and its moment by SciPy's root finding, nothing closed.
"""

from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import root

from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.scene import load_scene
from tests.verification import harness
from tests.verification.cases import subject
from tests.verification.slices_reference import C_L_N_MM, SlicedBearing
from tests.verification.test_energy_balance import lost, stored_energy, supplied
from tests.verification.test_slices_law import RIG, SPAN_S

OSCULATIONS = {"outer_osculation": 0.97, "inner_osculation": 0.965}
OWN = {"bodies": {"free_rollers": True, "cages": 1}, "load": {"gravity": False}, "contact": {"radial_play": "0.25 mm"}}
SCENE: dict[str, Any] = harness.merged(RIG, OWN, {"line_contact": OSCULATIONS})
# Farther along the shaft than any load moves it, so that nothing small is lost, to load either row; or both rows.
RINGS_M = {1: np.array([20e-6, -95e-6, 1.2e-3]), 2: np.array([20e-6, -95e-6, -1.2e-3]), 0: np.array([0, -3e-4, 0])}
ROWS = [1, 0, pytest.param(2, marks=pytest.mark.long_form)]
CAGE_TILT_RAD, ALIGNED = 1e-3, 0.01  # of the largest load: rollers beside the tilt's plane are skewed by it
LAMINAE = 60
SCALE = np.array([1e-6, 1e-6, 1e-5])  # of slide, shift and tilt, for the root finding
LOAD = 3e-3  # of the largest load: a roller at the end of the load zone is pressed over two or three slices
POSE = 1e-6  # of the largest tilt and shift: what the root finding leaves
POWER = 1e-4  # of the losses: the polynomials for a slice's force and energy
LOADED = 0.05  # of the largest load


class Pose(NamedTuple):
    """A roller's centre along slot and axis, off the slot's middle [m], its tilt [rad], the outer race's force [N]."""

    slide_m: float
    axial_m: float
    tilt_rad: float
    on_roller_n: harness.FloatArray


def balanced_pose(bearing: SlicedBearing, number: int, ring_m: harness.FloatArray) -> Pose:
    """Place a roller in balance between the races; the outer race is displaced by `ring_m`, [3]."""
    length, profile = harness.geometry().roller_width_m, bearing.outer_osculation * harness.geometry().raceway_radius_m
    radii, *both = bearing.arcs(ring_m)
    centres = np.stack(both, axis=2)[:, number]
    x = ((np.arange(LAMINAE) + 0.5) / LAMINAE - 0.5) * length
    half = bearing.roller_m - profile + np.sqrt(profile**2 - x**2)

    def forces(pose: harness.FloatArray) -> tuple[harness.FloatArray, float]:
        """Compute the forces of both races on the roller [N], [outer and inner, 2: radial, axial], and moment [N m]."""
        turn = np.array([[np.cos(pose[2]), -np.sin(pose[2])], [np.sin(pose[2]), np.cos(pose[2])]])
        found, moment = np.zeros((2, 2)), 0.0
        for race, sign in enumerate((1.0, -1.0)):
            arm = turn @ np.array([sign * half, x])
            off = arm + pose[:2, None] - centres[race][:, None]
            far = np.hypot(*off)
            mm = 2e3 * np.maximum(far - radii[race], 0.0)
            per_m = C_L_N_MM * (1e3 * length) ** (8 / 9) / length * mm ** (10 / 9)
            force = -per_m * length / LAMINAE * off / far
            found[race] = force.sum(axis=1)
            moment += float((arm[1] * force[0] - arm[0] * force[1]).sum())
        return found, moment

    def left(scaled: harness.FloatArray) -> harness.FloatArray:
        both, moment = forces(scaled * SCALE)
        return np.array([*both.sum(axis=0), moment / 0.0185])

    pressed = float(np.mean(centres[:, 0] + [1, -1] * radii[:, 0]))  # an upright roller, a little against both races
    pose = root(left, np.array([pressed, 0.0, 0.0]) / SCALE, tol=1e-11).x * SCALE
    return Pose(*pose, forces(pose)[0][0])


@cache
def posed(row: int) -> tuple[harness.Parameters, list[Pose], harness.FloatArray]:
    """The model, every roller's pose under the ring that loads a row (0: both), the model's state there, at rest."""
    model, world = subject(SCENE)
    bearing = SlicedBearing.like(model, world.scene)
    poses = [balanced_pose(bearing, number, RINGS_M[row]) for number in range(len(model.slot_angle))]
    y = np.zeros_like(harness.rolling_state(model))
    where = harness.layout_of(y)
    y[where.ring] = RINGS_M[row]
    y[where.slide] = [p.slide_m + p.axial_m * np.tan(p.tilt_rad) for p in poses]
    return model, poses, y


def in_order(model: harness.Parameters, row: int) -> harness.FloatArray:
    """A row of the model's space, of all rollers in the state's order, after the latest evaluation."""
    return model.space[int(row) :][: len(model.slot_angle)].reshape(-1, 2).T.ravel()


@pytest.mark.parametrize("row", ROWS)
def test_loads_tilt_and_shift_are_those_of_the_static_solver(row):
    model, poses, y = posed(row)
    found = harness.rates(model, 0.0, y)
    load = found.load_n.sum(axis=2)
    expected = np.array([np.linalg.norm(p.on_roller_n) for p in poses])
    assert load == pytest.approx(np.stack([expected, expected]), abs=LOAD * expected.max())
    loaded = expected > LOADED * expected.max()
    g = harness.geometry()
    side = np.repeat([1.0, -1.0], len(poses) // 2)  # the axes of row 2's slots point to the mid-plane
    tilts, shifts = zip(*((p.tilt_rad, p.axial_m / np.cos(p.tilt_rad)) for p in poses), strict=True)
    for row, pose in ((col.TILT_SINE, side * np.sin(tilts)), (col.SHIFT_ALONG, side * shifts)):
        assert in_order(model, row)[loaded] == pytest.approx(pose[loaded], abs=POSE * np.abs(pose[loaded]).max())
    f_s, f_x = np.transpose([p.on_roller_n for p in poses])
    along = -(side * (f_s * np.sin(g.tilt_rad) + f_x * np.cos(g.tilt_rad))).sum()
    assert found.totals[col.RING_FORCE_Z] == pytest.approx(along, rel=LOAD)


def test_rollers_align_themselves_in_a_tilted_cage():
    """Where the cage holds them they slide back along their axes and turn back: no load moves."""
    model, _, y = posed(0)
    straight, tilted = harness.rates(model, 0.0, y).load_n.sum(axis=2), y.copy()
    tilted[harness.layout_of(y).cage] = CAGE_TILT_RAD, -CAGE_TILT_RAD, 0.0
    assert harness.rates(model, 0.0, tilted).load_n.sum(axis=2) == pytest.approx(straight, abs=ALIGNED * straight.max())


def rolling(model: harness.Parameters, rest: harness.FloatArray) -> harness.FloatArray:
    """The state with spins and a cage speed that friction leaves about as they are: the drive pays losses alone."""
    y, where, found = rest.copy(), harness.layout_of(rest), []
    shaft, ratio = model.drive.speed[1, 0], harness.geometry().pitch_radius_m / model.law.roller_radius
    for cage in (0.429, 0.432, None):
        share = cage or np.interp(0.0, *zip(*sorted(found), strict=True))
        y[where.shaft_cage_rate], y[where.spin] = share * shaft, -share * shaft * ratio
        for _ in range(4):
            now = harness.rates(model, 0.0, y).rate[where.spin]
            y[where.spin] += 0.01
            slope = (harness.rates(model, 0.0, y).rate[where.spin] - now) / 0.01
            y[where.spin] -= 0.01 + np.where(slope < -1.0, now / np.minimum(slope, -1.0), 0.0)
        found.append((float(harness.rates(model, 0.0, y).rate[where.shaft_cage_rate][0]), share))
    return y


@pytest.mark.parametrize("row", ROWS)
def test_power_at_an_instant(row):
    """Rollers and cage roll and rock: drive and load put in what is stored and lost.

    But for what the model leaves out, that a roller shifted by w moves by w tilt' along its slot, the tilt against the
    ring's own axes: nothing in a run, where rollers are in balance; here their slides are not.
    """
    model, _, y = posed(row)
    (_, world), rng, where = subject(SCENE), np.random.default_rng(row), harness.layout_of(y)
    y = rolling(model, y)
    y[where.slide_rate] = rng.normal(0, 1e-4, where.rollers)
    y[where.slide] += rng.normal(0, 3e-6, where.rollers)
    y[where.cage_rate] += [0.5, -0.5, 0.0]
    y[where.ring_rate] = rng.normal(0, 1e-4, 3)
    found = harness.rates(model, 0.0, y)
    shift = in_order(model, col.SHIFT_ALONG)

    def energy_and_tilts(t: float, y: harness.FloatArray) -> harness.FloatArray:
        return np.append(stored_energy(model, world, t, y), in_order(model, col.TILT_SINE))

    change, *tilting = harness.rate_of_change(energy_and_tilts, y, found.rate, SPAN_S)
    w_y, w_z = (in_order(model, row) for row in (col.CAGE_Y, col.CAGE_Z))
    reach = model.centre_distance + y[where.slide]
    along_n = model.roller_mass * (found.rate[where.slide_rate] - reach * (w_y**2 + w_z**2))
    left_out = float((along_n * shift * (np.array(tilting) - w_y)).sum())
    expected = supplied(found.totals) - lost(found.totals) + left_out
    assert change == pytest.approx(expected, abs=POWER * lost(found.totals))


AT_REST = {
    "contact": {"static_friction": 0.0, "dynamic_friction": 0.0},
    "line_contact": {"traction": "dry"},
    "shaft_speed": "1e-6 rpm",
}
LOADS = 2e-3  # of the largest: what the theory states of held rollers without axial load
# Row 1's share of the load in balance, by the rig's axial load. The approach of a roller is linear in the ring's
# displacements (T. A. Harris & M. N. Kotzalas, Essential Concepts of Bearing Technology, 2006, on combined load), a
# lamina's force is integrated over the parabola of the gap. Contact angles that change are left out.
ROW_1_SHARES = {0.0: 0.5, 12.5e3: 0.2438, 25e3: 0.0105, 49e3: 0.0}
SHARE, LEAST_SHARE = 0.03, 2e-3  # of a share, or of all load


def in_balance(axial_n: float, free: bool = True) -> harness.FloatArray:
    """Loads of the outer contacts in balance, [2 rows, M] [N]."""
    bodies = {"free_rollers": free, "cages": 1 if free else 2}  # whose kernels others use as well
    load = {"axial_n": axial_n, "gravity": False}
    model = harness.parameters(load_scene("rig", AT_REST | {"bodies": bodies, "load": load}))
    return harness.rates(model, 0.0, equilibrium_state(model)).load_n[0].sum(axis=1).reshape(2, -1)


@pytest.mark.parametrize("axial_n", ROW_1_SHARES)
def test_shares_of_the_rows_are_those_of_the_closed_form(axial_n):
    load_n, right = in_balance(axial_n), ROW_1_SHARES[axial_n]
    shares = load_n.sum(axis=1) / load_n.sum()
    assert shares == pytest.approx([right, 1 - right], rel=SHARE, abs=LEAST_SHARE)


def test_without_axial_load_held_rollers_carry_what_free_ones_do():
    held, free = (in_balance(0.0, free) for free in (False, True))
    assert np.abs(held - free).max() < LOADS * held.max()
    assert np.abs(in_balance(25e3, False) - in_balance(25e3)).max() > 10 * LOADS * held.max()
