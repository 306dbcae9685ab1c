"""Drilled holes, spalls and raised pieces, on races and on rollers: shape, place of contact, force, potential.

Reason: what a defect's edge does to the force is the vibration. Source: the circle that a hole is; a search over all of
a race's profile for the place that reaches farthest into the roller; and that forces without friction and
damping have a potential: on a way round that ends where it began they do no work, and on any other the work that is
missing from the energy in the contacts. The parabola that the kernel takes for the gap along the race, and finer slices
in a window than beside it, limit how well.
"""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.slices_kernel import foot_of_slice
from tests.verification.cases import subject
from tests.verification.harness import FloatArray, Parameters, geometry, layout_of, rates, rolling_state
from tests.verification.slices_reference import STATIC, slices_model

SPALL: dict[str, Any] = {"shape": "flat", "extent": "6 mm", "width": "10 mm", "axial": "-3 mm"}
RAISED = SPALL | {"extent": "3 mm", "height": "20 um", "axial": "0 mm"}
SHAPES: dict[str, dict[str, Any]] = {
    "hole": {"shape": "hole", "extent": "2 mm", "height": "-0.5 mm", "axial": "1 mm"},
    "spall with ramps": SPALL | {"height": "-0.05 mm", "ramp": "1 mm"},
    "shallow spall": SPALL | {"height": "-10 um", "ramp": "2 mm"},
    "raised piece with ramps": RAISED | {"ramp": "1 mm"},
    "raised piece": RAISED,
}
KINDS = ("outer", "inner", "roller")
PASSAGES = (*KINDS, "roller before the inner race")
PLACES = 401  # of the roller, over an opening and as much again
SEARCHED = 40_001
FOOT_M = 1e-8  # the search's own spacing of 0.3 um, on a slope of 0.02
# Of the rollers' slides from touching the outer race.
DEEP_M = {"outer": 10e-6, "inner": -20e-6, "roller": 10e-6, "roller before the inner race": -20e-6}
WAY_M = 5e-3  # the roller's way, to either side of an opening's middle
STEPS = 4000
# Of the energy that is stored or set free over the opening's edge; where a raised piece has no ramp, the roller's edge
# and its parabola differ by 16 nm: 0.2 % of the depth.
POTENTIAL, STEEP = 5e-3, 4e-2
SPRING = 1e-4  # of the energy of all rollers: the polynomials for a slice's force and energy
AREA = 1e-2  # of a hole: twelve slices of a circle, the chord in the middle of each
SIDE_M = 1e-4  # by which the ring is pushed aside
ASIDE = 6e-3  # of the largest force: a ring that is aside is 35 nm nearer, of 10 um
LOADS = 2e-3  # three parts of a contact are summed by size


def damaged(kind: str, shape: str) -> Parameters:
    return subject(STATIC, {"defect": SHAPES[shape] | {"kind": kind}}, make=slices_model).model


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
    share = np.clip(inside / ramp, 0.0, 1.0) if ramp > 0 else (inside > 0) * 1.0
    return floor * share


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


class Passage:
    """All rollers at rest between races; the first one stands before an opening, or the opening before a race."""

    def __init__(self, kind: str, shape: str) -> None:
        self.kind, self.model = kind, damaged(kind.split()[0], shape)
        self.y = rolling_state(self.model)
        self.where = layout_of(self.y)
        self.y[self.where.half :] = 0.0
        self.race = int("inner" in kind)
        outer, inner = self.model.slices.outer_radius, self.model.slices.inner_radius
        self.of_roller = kind.startswith("roller")
        self.per_m = 1 / (self.model.law.roller_radius if self.of_roller else (outer, inner)[self.race])
        g = geometry()
        self.touching = g.raceway_radius_m - g.roller_centre_distance_m - self.model.law.roller_radius

    def at(self, way_m: float, slide_m: float) -> tuple[float, float, float, float]:
        """Force of the race [N], energy [J], and forces along the way [N] and the first roller's slot [N]."""
        where, y = self.where, self.y
        y[where.slide] = self.touching + slide_m
        if self.of_roller:
            y[where.rotation] = way_m * self.per_m + np.pi * self.race
        else:
            y[where.cage] = [0.0, 0.0, np.pi / 2 - self.model.slot_angle[0] + way_m * self.per_m]
        found = rates(self.model, 0.0, y)
        t = found.totals
        if self.of_roller:
            moment = self.model.roller_axial * found.rate[where.spin][0]
        else:
            xx, yy, zz, xy, xz, yz = t[col.INERTIA]
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            moment = (inertia @ found.rate[where.cage_rate])[2]
        along_slot = self.model.roller_mass * found.rate[where.slide_rate].sum()
        return found.load_n[self.race, 0].sum(), t[col.CONTACT_ENERGY], moment * self.per_m, along_slot


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("kind", PASSAGES)
def test_forces_over_an_opening_have_a_potential(kind, shape):
    """From beside the opening onto its edge, deeper into the race, back, and up again."""
    passage = Passage(kind, shape)
    near, far = 0.3e-3, WAY_M
    start, end = DEEP_M[kind], 1.5 * DEEP_M[kind]
    corners = np.array([[far, start], [near, start], [near, end], [far, end], [far, start]])
    work, energy = [], []
    for a, b in pairwise(corners):
        path = a + (b - a) * np.linspace(0, 1, STEPS // 2 + 1)[:, None]
        _, stored, along, slot = np.array([passage.at(*place) for place in path]).T
        work.append(float(np.trapezoid(along, path[:, 0]) + np.trapezoid(slot, path[:, 1])))
        energy.append(float(stored[-1] - stored[0]))
    limit = STEEP if shape == "raised piece" else POTENTIAL
    over_the_edge = max(abs(energy[0]), abs(energy[2]))
    law = SPRING * max(abs(energy[1]), abs(energy[3]))
    assert np.array(work) == pytest.approx(-np.array(energy), abs=limit * over_the_edge + law)
    assert sum(work) == pytest.approx(0.0, abs=limit * over_the_edge)


@pytest.mark.parametrize("aside_m", [-SIDE_M, 0.0, SIDE_M])
def test_loads_over_an_opening_are_those_that_act(aside_m):
    """On a ring pushed aside, across the roller's radius, an opening is elsewhere: for forces as for recorded loads."""
    passage = Passage("outer", "spall with ramps")

    def loads(way_m: float, ring_m: float) -> tuple[float, float]:
        angle = np.pi / 2 + way_m * passage.per_m
        passage.y[passage.where.ring] = [ring_m * np.sin(angle), -ring_m * np.cos(angle), 0.0]
        passage.at(way_m, -1e-3)
        passage.y[0] = passage.touching + DEEP_M["outer"]
        found = rates(passage.model, 0.0, passage.y)
        return float(found.load_n[0, 0].sum()), float(np.linalg.norm(found.totals[col.RING_FORCE]))

    ways = np.linspace(2e-3, 4e-3, 21)
    recorded, acting = np.array([loads(way, aside_m) for way in ways]).T
    ahead = aside_m / geometry().pitch_radius_m / passage.per_m  # seen from the ring, the roller's centre moves on
    moved = np.array([loads(way + ahead, 0.0)[1] for way in ways])
    assert np.ptp(acting) > 0.3 * acting.max()
    assert recorded == pytest.approx(acting, rel=LOADS)
    assert acting == pytest.approx(moved, abs=ASIDE * acting.max())
