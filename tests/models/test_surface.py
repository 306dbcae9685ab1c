"""Continuous contact derived from the point cloud, and waves of races and rollers under it."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import quad

from srbval import load_scene
from srbval.arrays import FloatArray
from srbval.models.full import columns as col
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.frames_kernel import SurfaceHeights
from srbval.models.full.parameters import Parameters, felt_share, make_parameters, state_layout
from srbval.models.full.rates import rates
from srbval.models.line import DefectOnRace, Patch, line_parameters, patches
from srbval.scene import Scene, paper_scene
from tests.verification.harness import geometry, parameters

MILLION = 1_000_000  # points per circle: dense enough to be the limit
HALF_M, HEIGHT_M = 1.5e-3, 1e-4  # of the raised piece: half of its length, and its height
EDGE, EDGE_N = 5e-3, 2.0  # of the force of a raised piece: its edges fall between two of the points
LOAD, LOAD_N = 0.01, 5.0  # of a roller's load: 16 000 points are not yet the limit
TRACTION = 0.07  # of the largest traction: slips spread along the patch, a point has its own


def dense_scene(points: int, **changes: object) -> Scene:
    """The printed fit with K_c n_pc and C_c n_pc held."""
    paper = paper_scene(contact={"roller_fit": "printed"}, **changes)
    few = paper.contact.points_per_circle / points
    own = {name: few * getattr(paper.contact, name) for name in ("stiffness_n_m", "damping_ns_m")}
    return replace(paper, contact=replace(paper.contact, points_per_circle=points, **own))


@pytest.fixture(scope="module", params=["outer", "inner"])
def patch(request):
    return patches(geometry(), paper_scene().contact, 0.02, inner=request.param == "inner")[1]


def sum_of_points(patch: Patch, depth: float, count: int, raised_m: float = 0.0, middle: float = 0.0) -> float:
    """Direct sum over `count` points of a circle, each a spring, against a parabolic gap."""
    x = (np.arange(count) - count / 2 + 0.5) * 2 * math.pi * patch.race_radius_m / count
    lift = np.where(np.abs(x - middle) <= HALF_M, raised_m, 0.0)
    depths = np.maximum(depth + lift - patch.curvature_1_m * x**2 / 2, 0.0)
    each = patch.stiffness_n_m2 * patch.spacing_m * 500 / count  # K_c n_pc held
    return float(each * depths.sum())


@pytest.mark.parametrize("middle_m", [0.0, 3e-3])
@pytest.mark.parametrize("depth_m", [-5e-5, 3e-5])
def test_a_raised_piece_adds_what_its_points_do(patch, depth_m, middle_m):
    raised = DefectOnRace(HEIGHT_M, np.array([HALF_M]), math.inf, math.nan, middle_m=np.array([middle_m]))
    added = patch.added_n(np.array([depth_m]), raised)[0]
    direct = sum_of_points(patch, depth_m, MILLION, HEIGHT_M, middle_m) - sum_of_points(patch, depth_m, MILLION)
    assert added == pytest.approx(direct, rel=EDGE, abs=EDGE_N)


def pull(model: Parameters, state: np.ndarray, spin: float) -> float:
    """Traction on one loaded roller, its spin changed by `spin` [N]."""
    place = state_layout(model).spin.start + 5
    turned = state.copy()
    turned[place] += spin
    return float(rates(model, 0.0, turned).rate[place]) * model.roller_axial / model.law.roller_radius


def test_loads_in_balance_and_friction_are_those_of_dense_points():
    """Friction from sticking to sliding."""
    line = line_parameters(dense_scene(500), geometry())
    dense = make_parameters(dense_scene(16_000), geometry())
    state = equilibrium_state(line)
    assert rates(line, 0.0, state).load_n == pytest.approx(rates(dense, 0.0, state).load_n, rel=LOAD, abs=LOAD_N)
    spins = (-3.0, -1.0, -0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.5, 1.0, 3.0)
    own, right = (np.array([pull(model, state, spin) for spin in spins]) for model in (line, dense))
    assert np.abs(own - right).max() < TRACTION * np.abs(right).max()
    assert own[0] > 0 > own[-1]


ROLLERS, ROW = 38, 19
HEIGHT_M, ANGLES = 1e-7, 8192
ALONG = 0.008  # heights act along the slot, the race is moved along it too: the normal's lean, squared
CONTINUOUS = ["line", "slices"]


def scene_of(model: str = "line") -> Scene:
    bodies = {"cages": 1 if model == "line" else 2}  # whose kernels others use as well
    return load_scene("rig", {"model": model, "bodies": bodies})


def loaded(model: Parameters) -> FloatArray:
    """A state with every roller at rest in contact with both races."""
    layout = state_layout(model)
    y = np.zeros(2 * layout.half)
    y[layout.ring] = 5e-6, -130e-6, 2e-6
    y[layout.slide] = -60e-6
    return y


def loads(model: Parameters, y: FloatArray) -> FloatArray:
    return rates(model, 0.0, y).load_n.sum(axis=2)


def heights(races: FloatArray | float = 0.0, rollers: FloatArray | float = 0.0) -> SurfaceHeights:
    return SurfaceHeights(
        np.broadcast_to(races, (2, 2, ANGLES)).copy(), np.broadcast_to(rollers, (ROLLERS, ANGLES)).copy()
    )


def waves(order: int, phase: float) -> FloatArray:
    return HEIGHT_M * np.cos(order * 2 * math.pi * np.arange(ANGLES) / ANGLES + phase)


@pytest.mark.parametrize("model", CONTINUOUS)
def test_a_height_is_a_race_that_stands_nearer(model):
    """Of the outer race: the ring moved inwards along the slot; of the inner one: the roller moved inwards."""
    plain = parameters(scene_of(model))
    layout, y = state_layout(plain), loaded(plain)
    before = loads(plain, y)
    outer = loads(plain._replace(surface=heights(np.array([HEIGHT_M, 0.0])[:, None, None])), y) - before
    inner = loads(plain._replace(surface=heights(np.array([0.0, HEIGHT_M])[:, None, None])), y) - before
    assert outer[0].max() > 10
    for j in np.flatnonzero(before[0] > 1000)[:4]:
        angle, side = plain.slot_angle[j], 1 if j < ROW else -1
        slot = (plain.tilt_cosine * math.cos(angle), plain.tilt_cosine * math.sin(angle), side * plain.tilt_sine)
        moved = y.copy()
        moved[layout.ring] -= HEIGHT_M * np.array(slot)
        assert outer[0, j] == pytest.approx(loads(plain, moved)[0, j] - before[0, j], rel=ALONG)
    for j in np.flatnonzero(before[1] > 1000)[:4]:
        moved = y.copy()
        moved[layout.slide][j] -= HEIGHT_M
        assert inner[1, j] == pytest.approx(loads(plain, moved)[1, j] - before[1, j], rel=ALONG)


@pytest.mark.parametrize("race", [0, 1])
def test_the_height_is_that_under_the_roller(race):
    """Of a race at the slot's angle less the race's own, of a roller at the contact's less the roller's own."""
    plain = parameters(scene_of())
    layout, y = state_layout(plain), loaded(plain)
    y[layout.cage][2], shaft, spun = 0.3, 1.1, 0.7
    y[layout.rotation] = spun
    at = plain._replace(drive=plain.drive._replace(speed=np.array([[0.0], [0.0], [shaft]])))
    found = loads(at._replace(surface=heights(waves(7, 0.4), waves(5, 0.9))), y)
    for j in np.flatnonzero(loads(at, y)[race] > 1000)[:4]:
        of_race = HEIGHT_M * math.cos(7 * (plain.slot_angle[j] + 0.3 - race * shaft) + 0.4)
        of_roller = HEIGHT_M * math.cos(5 * (race * math.pi - spun) + 0.9)
        before = loads(at, y)[race, j]
        alike = loads(at._replace(surface=heights(of_race + of_roller)), y)[race, j] - before
        assert found[race, j] - before == pytest.approx(alike, rel=1e-3)  # straight lines between the angles
        assert abs(alike) > 1


def test_a_contact_begins_with_its_height():
    """A roller clear of both races touches them, and is searched for, where they stand higher than it is clear."""
    plain = parameters(scene_of())
    y = np.zeros(2 * state_layout(plain).half)
    assert not loads(plain, y).any()
    depth = [plain.space[int(col.MIDDLE_DEPTH) + race * col.RACE] for race in range(2)]
    assert sum(depth) == pytest.approx(-45.55e-6, rel=1e-3)  # the scene's play
    for race in range(2):
        for beyond_m, touches in ((1e-6, True), (-1e-6, False)):
            own = np.zeros((2, 1, 1))
            own[race] = beyond_m - depth[race]
            found = loads(plain._replace(surface=heights(own)), y)
            assert found[race].all() if touches else not found[race].any()
            assert not found[1 - race].any()


@pytest.mark.parametrize("reach", [0.5, 1.0, 2.0])
def test_a_contact_feels_the_mean_of_a_wave_under_a_flat_punch(reach):
    """Betti's reciprocity theorem: heights weighted as the pressure of a flat punch, x = b sin(angle)."""
    mean, _ = quad(lambda angle: math.cos(reach * math.sin(angle)) / math.pi, -math.pi / 2, math.pi / 2)
    assert felt_share(np.array([reach]), 1.0)[0] == pytest.approx(mean)


def test_a_seed_says_all():
    rough = {"surface": {"roughness_class": "N3"}}
    first, again, other = (parameters(load_scene("rig", rough | {"seed": seed})).surface for seed in (1, 1, 2))
    for a, b, c in zip(first, again, other, strict=True):
        assert np.array_equal(a, b)
        assert np.abs(np.corrcoef(a.ravel(), c.ravel())[0, 1]) < 0.1
    assert first.races.shape[:2] == (2, 2)
    assert np.abs(np.corrcoef(first.races.reshape(4, -1)) - np.eye(4)).max() < 0.2  # each row of a race has its own
