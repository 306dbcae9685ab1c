import math

import numpy as np
import pytest

from srbval.bearing import CIRCLES
from srbval.models.full.point_cloud import (
    DEEPEST_M,
    candidate_windows,
    circle_points,
    clearance_aside_m,
    inner_circle,
    outer_circle,
    window_half_count,
    wrapped,
)
from srbval.scene import Defect, paper_scene
from tests.verification.harness import geometry, parameters

GEOMETRY = geometry()
LEAST_CLEARANCE = 0.97  # of the true one: the rest is the circles' own curvature
ROUNDED_TABLE_1_M = 2e-5  # Table 1 gives hundredths of a millimetre
ROUNDING = 1e-12  # of a length
DIAMETER_M = 1e-5  # as Table 1 rounds it


@pytest.mark.parametrize("p", CIRCLES)
def test_both_raceways_face_the_roller(p: float) -> None:
    """Each circle lies one roller radius from the roller's profile, the inner one with eq. (17)'s sign mended."""
    reach = GEOMETRY.roller_centre_distance_m
    centre = np.array([reach * math.cos(GEOMETRY.tilt_rad), reach * math.sin(GEOMETRY.tilt_rad)])
    slot = centre / reach
    for circle, side in ((outer_circle(GEOMETRY, p), 1.0), (inner_circle(GEOMETRY, p), -1.0)):
        point = np.array([circle.radius_m, circle.height_m])
        arc_centre = centre - side * slot * (GEOMETRY.raceway_radius_m - GEOMETRY.zero_play_diameter_m / 2)
        distance = np.linalg.norm(point - arc_centre)
        assert distance == pytest.approx(GEOMETRY.raceway_radius_m, abs=ROUNDED_TABLE_1_M)
        towards_roller = (centre - point) @ np.array([circle.normal_radial, circle.normal_axial])
        assert towards_roller > 0, "the normal points at the rollers"
    assert inner_circle(GEOMETRY, 1.0).radius_m == pytest.approx(0.1221, abs=ROUNDED_TABLE_1_M)


def made(**changes: object) -> Defect:
    """The paper's defect with `changes`."""
    return paper_scene(defect={"kind": "outer", **changes}).defect


def test_a_bump_moves_its_points_towards_the_rollers() -> None:
    circles = [outer_circle(GEOMETRY, p) for p in CIRCLES]
    plain = [circle_points(500, c.radius_m, (), 0.0) for c in circles]
    moved = circle_points(500, circles[1].radius_m, [made()], math.pi / 2)
    raised = np.flatnonzero(moved.lift)
    assert np.array_equal(raised, [124, 125]) or np.array_equal(raised, [125, 126])
    windows = candidate_windows(circles, [plain, [plain[0], moved, plain[2]]], 500, 2)
    own, widest = windows.window_of[1, 125], 4
    assert own > widest
    assert windows.window_of[1, 0] == widest
    assert windows.highest[own] == 2e-4
    lifted = np.linalg.norm((windows.points[own] - windows.points[widest])[:3], axis=0)
    assert sorted(lifted)[-2:] == pytest.approx([2e-4, 2e-4])
    radius = np.hypot(*windows.points[own][:2])[np.argsort(lifted)[-2:]]
    assert np.all(radius < circles[1].radius_m), "off the outer race means inwards"


def test_a_pit_as_drilled_on_the_rig() -> None:
    """2 mm wide, 0.5 mm deep, eight times finer points: stiffness conserved, width right."""
    radius = outer_circle(GEOMETRY, 1.0).radius_m
    pit = circle_points(500, radius, [made(height="-0.5 mm", extent="2 mm", refinement=8)], 1.0)
    assert pit.share.sum() == pytest.approx(500)
    deep = np.abs(wrapped(pit.angle[pit.lift < 0] - 1.0)) * radius
    assert deep.max() == pytest.approx(1e-3, abs=2 * math.pi * radius / 500 / 8)
    assert set(np.unique(pit.lift)) == {0.0, -5e-4}
    assert np.count_nonzero(pit.lift) == pytest.approx(8, abs=1)


@pytest.mark.parametrize("points", [500, 4000])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_point_aside_stands_clear_by_no_less_than_said(points: int, sign: int) -> None:
    """Against circles that meet: exact, and no more than what the circles' curvature leaves out below it."""
    r = GEOMETRY.zero_play_diameter_m / 2
    radius = (inner_circle if sign > 0 else outer_circle)(GEOMETRY, 1.0).radius_m
    said = clearance_aside_m(r, sign * radius, points_per_circle=points)
    for spacings in (0.3, 1.0, 2.0):
        angle = spacings * 2 * math.pi / points
        clear = math.hypot(radius * math.cos(angle) - radius - sign * r, radius * math.sin(angle)) - r
        assert LEAST_CLEARANCE <= said * spacings**2 / clear <= 1.0


@pytest.mark.parametrize("points", [500, 4000])
def test_no_point_beyond_the_window_can_touch(points: int) -> None:
    """Brute force: a roller at every phase between two points, pressed in as deep as the search allows."""
    r = GEOMETRY.zero_play_diameter_m / 2
    for radius, sign in ((outer_circle(GEOMETRY, 1.0).radius_m, -1), (inner_circle(GEOMETRY, 1.0).radius_m, 1)):
        half = window_half_count(r, sign * radius, points_per_circle=points, highest_m=0.0)
        centre = radius + sign * (r - DEEPEST_M)
        k = np.arange(points)
        for phase in np.linspace(-0.5, 0.5, 11):
            angle = 2 * np.pi * (k - phase) / points
            distance = np.hypot(radius * np.cos(angle) - centre, radius * np.sin(angle))
            touching = np.flatnonzero(distance < r)
            offset = np.minimum(touching, points - touching)
            assert offset.max() <= half


@pytest.mark.parametrize(("play", "diameter"), [("0 m", 0.04001), ("0.1 mm", 0.03991), ("-0.05 mm", 0.04006)])
def test_diameter_follows_from_the_play(play: str, diameter: float) -> None:
    model = parameters(paper_scene(contact={"radial_play": play}))
    assert 2 * model.law.roller_radius == pytest.approx(diameter, abs=DIAMETER_M)
    printed = parameters(paper_scene(contact={"roller_fit": "printed"}))
    assert 2 * printed.law.roller_radius == pytest.approx(0.0401, rel=ROUNDING)
