"""Slices: how one gives way, friction over it, openings in races and rollers; work = energy stored + energy lost.

Law. Reason: the kernels use polynomials and a root in single precision with a correction; a wrong coefficient would
bend every result a little. Source: the laws themselves, q = k e^(10/9) over a slice whose penetration runs from one end
to the other, and eq. (19), integrated with SciPy.

Openings. Reason: what a defect's edge does to the force is the vibration. Source: the circle that a hole is; a search
over all of a race's profile for the place that reaches farthest into the roller; and that forces without friction and
damping have a potential: on a way round that ends where it began they do no work, and on any other the work that is
missing from the energy in the contacts. The parabola that the kernel takes for the gap along the race, and finer slices
in a window than beside it, limit how well.

Work, at an instant. Reason: a force whose work is not accounted for would heat or cool the run unseen. Source: first
law, with the kinetic energy of `world.py`; the energy in the contacts is the model's, whose slope the balance tests.
What is left is the mismatch of the polynomials for a slice's force and energy, and of the place where the force acts.
"""

import math
from functools import partial
from typing import Any

import numpy as np
import pytest
from scipy.integrate import quad

from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.slices_kernel import foot_of_slice, friction_of_slice, slice_spring
from tests.verification.cases import disturbed, subject
from tests.verification.harness import FloatArray, Parameters, geometry, layout_of, rate_of_change, rates, rolling_state
from tests.verification.slices_reference import STATIC
from tests.verification.test_energy_balance import lost, stored_energy, supplied
from tests.verification.world import World

STIFFNESS = 3e12  # N/m^(10/9), a slice of some 3 mm
DEPTHS_M = (-4.9e-5, -3e-6, -4e-8, 0.0, 1e-7, 2e-6, 1.5e-5, 8e-5, 5e-4)
SPREADS_M = (1e-8, 2e-7, 5e-6, 1e-4)
# The kernels' polynomials: force to 8e-5, slope to 2e-3, energy to 2e-5, middle to 2e-4 of the touched length; the
# ninth root adds 2e-6.
FORCE, SLOPE, ENERGY, MIDDLE = 1e-4, 2.5e-3, 3e-5, 3e-4
UNTOUCHED_N = 1e-15
POINTS = 20_000
MEAN = 1e-8  # quadrature's own; the kernel adds LEAST_SLIP = 1e-9 m/s to slips of 1e-5 and more
SLIPS_M_S = (1e-5, 3e-4, 8e-4, 1.2e-3, 2e-3, 0.1)
RANGES_M_S = (1e-5, 2e-4, 9e-4, 1.6e-3, 0.05)
# Over the curvature of the gap: how far the line that stands for it is off, of the force at a depth of the spread. 4 is
# the slice in the middle of a contact that is no longer than that: it comes into contact at a corner of the line.
BENT = {0.5: 2e-3, 1.0: 4e-3, 2.0: 1.2e-2, 4.0: 0.13}
BENT_WHOLE = 4e-3  # the same, of slices that touch on all their width
FLAT, LEAST_M = 0.0, 1e-9


def touched(depth: float, spread: float) -> tuple[float, float]:
    """Ends of the part of a slice that touches, in widths from its middle; penetration is depth + spread x."""
    return max(-0.5, -depth / spread), 0.5


def integral(depth: float, spread: float, power: float, arm: int = 0) -> float:
    """Integral over a slice of its penetration's power, times (x - its lower end)^arm."""
    low, high = touched(depth, spread)
    if low >= high:
        return 0.0
    whole, _ = quad(
        lambda x: max(depth + spread * x, 0.0) ** power * (x - low) ** arm, low, high, epsabs=0.0, epsrel=1e-11
    )
    return float(whole)


@pytest.mark.parametrize("spread", SPREADS_M)
@pytest.mark.parametrize("depth", DEPTHS_M)
def test_spring_of_a_slice(depth, spread):
    force, slope, twice_energy, part, off = slice_spring(STIFFNESS, depth, spread, FLAT, LEAST_M)
    low, high = touched(depth, spread)
    expected = STIFFNESS * integral(depth, spread, 10 / 9)
    if expected == 0:
        assert 0 <= force < UNTOUCHED_N
        assert 0 <= twice_energy < UNTOUCHED_N
        return
    assert force == pytest.approx(expected, rel=FORCE)
    assert slope == pytest.approx(10 / 9 * STIFFNESS * integral(depth, spread, 1 / 9), rel=SLOPE)
    assert twice_energy / 2 == pytest.approx(9 / 19 * STIFFNESS * integral(depth, spread, 19 / 9), rel=ENERGY)
    assert part == pytest.approx(high - low)
    centroid = low + STIFFNESS * integral(depth, spread, 10 / 9, arm=1) / expected
    assert off == pytest.approx(centroid, abs=MIDDLE * (high - low))
    assert centroid >= -MIDDLE  # the deeper end bears more


@pytest.mark.parametrize("bent", BENT)
@pytest.mark.parametrize("share", [-0.4, -0.25, 0.0, 0.25, 0.5, 1.0, 3.0])
def test_a_slice_follows_the_bent_gap(share, bent):
    """Penetration depth + spread x - bend (x^2 / 2 - 1 / 24), x in widths from the middle; depth is its mean."""
    spread = 5e-6
    depth, bend = share * spread, bent * spread
    x = (np.arange(POINTS) + 0.5) / POINTS - 0.5
    penetration = np.maximum(depth + spread * x - bend * (x**2 / 2 - 1 / 24), 0.0)
    force = slice_spring(STIFFNESS, depth, spread, bend, bend / 4)[0]
    expected = STIFFNESS * float((penetration ** (10 / 9)).mean())
    limit = BENT_WHOLE if penetration.min() > 0 else BENT[bent]
    assert force == pytest.approx(expected, abs=limit * STIFFNESS * spread ** (10 / 9))


def coefficient(slip: float, static: float, dynamic: float, critical: float) -> float:
    """Eq. (19)."""
    return float(math.copysign(np.interp(abs(slip), [0, critical, 1.5 * critical], [0, static, dynamic]), slip))


@pytest.mark.parametrize("static", [0.7, 0.5])
@pytest.mark.parametrize("more", RANGES_M_S)
@pytest.mark.parametrize("slip", SLIPS_M_S)
def test_friction_of_a_slice(slip, more, static):
    """Mean of eq. (19) over slips from `slip` less `more` to `slip` and `more`, over the slip in the middle."""
    contact = {"static_friction": static, "dynamic_friction": 0.5, "critical_velocity": "1 mm/s"}
    law = subject({"model": "slices", "contact": contact})[0].law
    kinks = [side * size for side in (-1, 1) for size in (0.0, 1e-3, 1.5e-3) if abs(side * size - slip) < more]
    places = sorted(set(kinks)) or None
    whole, _ = quad(coefficient, slip - more, slip + more, args=(static, 0.5, 1e-3), points=places, epsrel=1e-10)
    found = friction_of_slice(law, slip, more)
    assert found > 0  # against the slip
    assert found * slip == pytest.approx(whole / (2 * more), rel=MEAN, abs=MEAN)


SPALLED: dict[str, Any] = {"shape": "flat", "extent": "6 mm", "width": "10 mm", "axial": "-3 mm"}
RAISED = SPALLED | {"extent": "3 mm", "height": "20 um", "axial": "0 mm"}
SHAPES: dict[str, dict[str, Any]] = {
    "hole": {"shape": "hole", "extent": "2 mm", "height": "-0.5 mm", "axial": "1 mm"},
    "spall with ramps": SPALLED | {"height": "-0.05 mm", "ramp": "1 mm"},
    "shallow spall": SPALLED | {"height": "-10 um", "ramp": "2 mm"},
    "raised piece with ramps": RAISED | {"ramp": "1 mm"},
    "raised piece": RAISED,
}
KINDS = ("outer", "inner", "roller")
PLACES = 101  # of the roller, over an opening and as much again
SEARCHED = 40_001
FOOT_M = 1e-8  # the search's own spacing of 0.3 um, on a slope of 0.02
ASIDE = 6e-3  # of the largest force: a ring that is aside is 35 nm nearer, of 10 um
LOADS = 2e-3  # three parts of a contact are summed by size
AREA = 1e-2  # of a hole: twelve slices of a circle, the chord in the middle of each


def damaged(kind: str, shape: str) -> Parameters:
    return subject(STATIC, {"defect": SHAPES[shape] | {"kind": kind}})[0]


def race_and_window(kind: str, model: Parameters) -> tuple[int, int, FloatArray]:
    """The race with the opening, the number of the window that has it, and its rows."""
    race = int(kind == "inner")
    window = int(model.slices.rows[race, :, col.SLICE_HALF].max(axis=1).argmax())
    return race, window, model.slices.rows[race, window]


@pytest.mark.parametrize("kind", KINDS)
def test_a_hole_is_round(kind):
    """Half of each slice's chord, their sum the circle's area; the slices end where the hole does."""
    _, _, rows = race_and_window(kind, damaged(kind, "hole"))
    rows = rows[:, rows[col.SLICE_WIDTH] > 0]
    half, width = rows[col.SLICE_HALF], rows[col.SLICE_WIDTH]
    assert width.sum() == pytest.approx(geometry().roller_width_m)
    edges = np.concatenate([[0.0], np.cumsum(width)]) - geometry().roller_width_m / 2
    middle = (edges[1:] + edges[:-1]) / 2
    inside = half > 0
    assert (edges[:-1][inside][0], edges[1:][inside][-1]) == pytest.approx((0.0, 2e-3), abs=1e-12)
    assert half[inside] == pytest.approx(np.sqrt(1e-6 - (middle[inside] - 1e-3) ** 2))
    assert 2 * half @ width == pytest.approx(np.pi * 1e-6, rel=AREA)
    assert rows[col.SLICE_FLOOR][inside] == pytest.approx(5e-4)
    assert not rows[col.SLICE_FLOOR][~inside].any()


def below(along: FloatArray, half: float, floor: float, ramp: float) -> FloatArray:
    """Depth of a race's profile below its surface [m] at places along it from the middle of an opening."""
    inside = half - np.abs(along)
    return floor * (np.clip(inside / ramp, 0.0, 1.0) if ramp > 0 else (inside > 0) * 1.0)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", KINDS)
def test_a_roller_rests_on_what_reaches_farthest_into_it(kind, shape):
    model = damaged(kind, shape)
    race, window, rows = race_and_window(kind, model)
    i = int(rows[col.SLICE_HALF].argmax())
    radial, normal, sag = rows[col.SLICE_RADIAL, i], rows[col.SLICE_NORMAL_RADIAL, i], rows[col.SLICE_SAG, i]
    half, floor, ramp = rows[col.SLICE_HALF, i], rows[col.SLICE_FLOOR, i], rows[col.SLICE_RAMP, i]
    profile = np.append(np.linspace(-2 * half, 2 * half, SEARCHED), [half, -half])
    for roller in np.linspace(-2 * half, 2 * half, PLACES):
        r, t, z = foot_of_slice(model.slices.rows, race, window, i, roller)
        along, sunk = np.arctan2(t, r) * radial, (radial - np.hypot(r, t)) / normal
        assert sunk == pytest.approx((rows[col.SLICE_AXIAL, i] - z) / rows[col.SLICE_NORMAL_AXIAL, i], abs=FOOT_M)
        farthest = (below(profile, half, floor, ramp) + sag * (profile - roller) ** 2).min()
        assert sunk + sag * along**2 == pytest.approx(min(farthest, sag * (half - abs(roller)) ** 2), abs=FOOT_M)


@pytest.mark.parametrize("aside_m", [-1e-4, 1e-4])
def test_loads_over_an_opening_are_those_that_act(aside_m):
    """One roller at rest above a spall; on a ring pushed aside, across its radius, the opening is elsewhere."""
    model, g = damaged("outer", "spall with ramps"), geometry()
    y = np.zeros_like(rolling_state(model))
    where = layout_of(y)
    touching = g.raceway_radius_m - g.roller_centre_distance_m - model.law.roller_radius

    def loads(way_m: float, ring_m: float) -> tuple[float, float]:
        angle = np.pi / 2 + way_m / model.slices.outer_radius
        y[where.ring] = [ring_m * np.sin(angle), -ring_m * np.cos(angle), 0.0]
        y[where.cage] = [0.0, 0.0, angle - model.slot_angle[0]]
        y[where.slide] = touching - 1e-3
        y[0] = touching + 10e-6
        found = rates(model, 0.0, y)
        return float(found.load_n[0, 0].sum()), float(np.linalg.norm(found.totals[col.RING_FORCE]))

    ways, ahead = np.linspace(2e-3, 4e-3, 21), aside_m / g.pitch_radius_m * model.slices.outer_radius
    recorded, acting = np.array([loads(way, aside_m) for way in ways]).T
    moved = np.array([loads(way + ahead, 0.0)[1] for way in ways])  # seen from the ring, the roller's centre moves on
    assert np.ptp(acting) > 0.3 * acting.max()
    assert recorded == pytest.approx(acting, rel=LOADS)
    assert acting == pytest.approx(moved, abs=ASIDE * acting.max())


RIG: dict[str, Any] = {"model": "slices", "bodies": {"cages": 2}, "load": {"path": "bearing", "gravity": True}}
RIG |= {"shaft_speed": "858.94 rpm", "line_contact": {"traction": "lubricated"}}
HOLE = SHAPES["hole"] | {"axial": "0 mm"}
CASES: dict[str, dict[str, Any]] = {
    "healthy": {},
    "radial and axial": {"load": {"axial": "20 kN"}},
    "dry": {"line_contact": {"traction": "dry"}, "contact": {"static_friction": 0.05, "dynamic_friction": 0.05}},
    "drilled outer race": {"defect": HOLE | {"kind": "outer"}},
    "spall of the inner race": {"defect": SHAPES["spall with ramps"] | {"kind": "inner"}},
    "drilled roller": {"defect": HOLE | {"kind": "roller"}},
    "shallow spall": {"defect": SHAPES["shallow spall"] | {"kind": "outer"}},
    "raised piece": {"defect": SHAPES["raised piece with ramps"] | {"kind": "roller"}},
}
SEEDS = (1, 2, 3)
OVER_RAD = 0.005  # a roller at the edge of the opening: 0.8 mm from its middle
SPAN_S = 1e-7
INSTANT = 1e-3  # of the largest power: the polynomials for a slice's force and energy
# The model turns a race's meridian to the roller's centre: a roller that the cage's tilt takes out of it meets the race
# beside its deepest place, by 2 um for 1e-4 rad, and what rolling moves that place by is not the force's work.
TILT_RAD, TILTED = 1e-4, 6e-3  # of the largest power
OFF_M = 5e-6


def moving(name: str, seed: int, tilt_rad: float) -> tuple[Parameters, World, FloatArray]:
    """The model of a case, and a state in balance with everything moved a little."""
    model, world = subject(RIG, CASES[name])
    y = equilibrium_state(model, cage_angle_rad=world.scene.load.zone_rad + OVER_RAD)
    return model, world, disturbed(y, seed, tilt_rad=tilt_rad, off_m=OFF_M)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize(("tilt_rad", "limit"), [(0.0, INSTANT), (TILT_RAD, TILTED)])
@pytest.mark.parametrize("name", CASES)
def test_balance_at_an_instant(name, tilt_rad, limit, seed):
    model, world, y = moving(name, seed, tilt_rad)
    found = rates(model, 0.0, y)
    change = rate_of_change(partial(stored_energy, model, world), y, found.rate, SPAN_S)
    largest = max(abs(supplied(found.totals)), lost(found.totals))
    assert change == pytest.approx(supplied(found.totals) - lost(found.totals), abs=limit * largest)
