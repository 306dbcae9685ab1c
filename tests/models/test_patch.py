"""Continuous contact derived from the point cloud: stiffness, raised pieces, friction, the line model's limit."""

import math
from dataclasses import replace

import numpy as np
import pytest

from srbval import load_bearing, simulate
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters, make_parameters
from srbval.models.full.steps import rates
from srbval.models.line import Patch, Piece, line_parameters, patches, piece
from srbval.plan.measures import measure
from srbval.plan.questions import Question, answers
from srbval.scene import RollerFit, Scene, paper_scene
from tests.verification.harness import geometry

DENSE = 4000  # points per circle: eight times the paper's
MILLION = 1_000_000  # points per circle: dense enough to be the limit
CAGE_TOLERANCE = 2e-4
QUIETER = 10
EDGE, EDGE_N = 5e-3, 2.0  # of the force of a raised piece: its edges fall between two of the points
LOAD, LOAD_N = 0.01, 5.0  # of a roller's load: 16 000 points are not yet the limit
TRACTION = 0.07  # of the largest traction: slips spread along the patch, a point has its own


def dense_scene(points: int, **changes: object) -> Scene:
    """The printed fit with K_c n_pc and C_c n_pc held."""
    paper = paper_scene(contact={"roller_fit": "printed"}, **changes)
    few = paper.contact.points_per_circle / points
    contact = replace(
        paper.contact,
        points_per_circle=points,
        stiffness_n_m=few * paper.contact.stiffness_n_m,
        damping_ns_m=few * paper.contact.damping_ns_m,
    )
    return replace(paper, contact=contact)


@pytest.fixture(scope="module", params=["outer", "inner"])
def patch(request):
    return patches(geometry(), paper_scene().contact, 0.02, inner=request.param == "inner")[1]


def sum_of_points(patch: Patch, depth: float, count: int, raised: Piece | None = None, middle: float = 0.0) -> float:
    """Direct sum over `count` points of a circle, each a spring, against a parabolic gap."""
    x = (np.arange(count) - count / 2 + 0.5) * 2 * math.pi * patch.race_radius_m / count
    lift = np.zeros(count)
    if raised is not None:
        for offset, height in zip(raised.offset_m, raised.height_m, strict=True):
            lift[np.abs(x - middle - offset) <= raised.part_m / 2] += height
    depths = np.maximum(depth + lift - patch.curvature_1_m * x**2 / 2, 0.0)
    each = patch.stiffness_n_m2 * patch.spacing_m * 500 / count  # K_c n_pc held
    return float(each * depths.sum())


@pytest.mark.parametrize("middle_m", [0.0, 3e-3])
@pytest.mark.parametrize("depth_m", [-5e-5, 3e-5])
@pytest.mark.parametrize("shape", ["flat", "cosine"])
def test_a_raised_piece_adds_what_its_points_do(patch, depth_m, middle_m, shape):
    defect = {"kind": "outer", "height": "0.1 mm", "extent": "3 mm", "shape": shape}
    part = piece(paper_scene(defect=defect).defect, patch.spacing_m)
    added = patch.raised_force_n(np.array([depth_m]), np.array([middle_m]), part)[0]
    direct = sum_of_points(patch, depth_m, MILLION, part, middle_m) - sum_of_points(patch, depth_m, MILLION)
    assert added == pytest.approx(direct, rel=EDGE, abs=EDGE_N)


def test_loads_in_balance_are_those_of_dense_points():
    line = line_parameters(dense_scene(500), geometry())
    dense = make_parameters(dense_scene(16_000), geometry())
    state = equilibrium_state(line)
    assert rates(line, 0.0, state).load_n == pytest.approx(rates(dense, 0.0, state).load_n, rel=LOAD, abs=LOAD_N)


def pull(model: Parameters, state: np.ndarray, spin: float) -> float:
    """Traction on one loaded roller, its spin changed by `spin` [N]."""
    roller, rollers = 5, len(model.slot_angle)
    place = 2 * rollers + 6 + rollers + roller
    turned = state.copy()
    turned[place] += spin
    return float(rates(model, 0.0, turned).rate[place]) * model.roller_axial / model.law.roller_radius


def test_friction_of_a_patch_is_that_of_dense_points():
    """From sticking to sliding."""
    line = line_parameters(dense_scene(500), geometry())
    dense = make_parameters(dense_scene(16_000), geometry())
    state = equilibrium_state(line)
    spins = (-3.0, -1.0, -0.5, -0.2, -0.1, 0.0, 0.1, 0.2, 0.5, 1.0, 3.0)
    own, right = (np.array([pull(model, state, spin) for spin in spins]) for model in (line, dense))
    assert np.abs(own - right).max() < TRACTION * np.abs(right).max()
    assert own[0] > 0 > own[-1]


@pytest.mark.slow
@pytest.mark.parametrize("fit", ["play", pytest.param("printed", marks=pytest.mark.long_form)])
def test_the_line_model_is_the_limit_of_ever_denser_points(fit):
    """Cage speed, and a healthy bearing without the noise of points passing; with play 0 as with interference."""
    scenes = (dense_scene(500, model="line"), dense_scene(500), dense_scene(DENSE))
    runs = [simulate(replace(s, duration_s=1.0, contact=replace(s.contact, roller_fit=RollerFit(fit)))) for s in scenes]
    line, paper, dense = (measure(run) for run in runs)
    floors = [answers(run, load_bearing("skf-22240"))[Question.NOISE_FLOOR] for run in runs]
    assert line.cage_ratio == pytest.approx(dense.cage_ratio, rel=CAGE_TOLERANCE)
    assert QUIETER * floors[0][0] < floors[1][0]
    assert QUIETER * line.band_rms_m_s2 < paper.band_rms_m_s2
    assert dense.band_rms_m_s2 < paper.band_rms_m_s2
