"""What the slices model takes from scene and bearing."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from srbval.bearing import SphericalRollerGeometry, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.full import columns as col
from srbval.models.full.parameters import Parameters
from srbval.models.slices import SlicedContact, slice_parameters
from srbval.scene import Scene, paper_scene

STEEL = 35948.0  # N/mm^(10/9) times (L / mm)^(8/9), ISO/TS 16281
ROUNDING = 1e-12


def geometry(**changes: Any) -> SphericalRollerGeometry:
    found = load_bearing("skf-22240").geometry
    return replace(found, **changes)


def sliced(**line_contact: Any) -> Parameters:
    return slice_parameters(paper_scene(line_contact=line_contact), geometry())


@pytest.mark.parametrize("inner_osculation", [0.93, 0.97, 1.0])
def test_the_inner_race_stays_where_the_roller_meets_it(inner_osculation: float) -> None:
    """Its arc's centre moves along the contact normal, so that play and rolling radius are those of the paper."""
    model = sliced(outer_osculation=0.97, inner_osculation=inner_osculation)
    outwards = np.array([model.tilt_cosine, model.tilt_sine])
    centre = np.array([model.inner_centre_radial, model.inner_centre_axial])
    paper = np.array([geometry().inner_centre_radial_m, geometry().inner_centre_axial_m])
    foot = centre - model.race_radius[1] * outwards
    assert foot == pytest.approx(paper - geometry().raceway_radius_m * outwards, abs=ROUNDING)


@pytest.mark.parametrize("slices", [3, 11, 40])
def test_slices_make_up_the_roller(slices: int) -> None:
    """Widths add up to its length, springs in parallel to c_L, twice the approach of one contact being the pair's."""
    model, length = sliced(slices=slices), geometry().roller_width_m
    for rows in model.slices.rows[:, 0]:
        assert rows.shape[1] == slices
        assert rows[col.SLICE_WIDTH].sum() == pytest.approx(length)
        both = rows[col.SLICE_STIFFNESS].sum() / 2 ** (10 / 9) / 1e3 ** (10 / 9)  # N/mm^(10/9)
        assert both == pytest.approx(STEEL * (1e3 * length) ** (8 / 9))
        assert np.hypot(rows[col.SLICE_NORMAL_RADIAL], rows[col.SLICE_NORMAL_AXIAL]) == pytest.approx(1.0)


@pytest.mark.parametrize("inner", [False, True])
def test_gap_along_the_race_is_that_of_two_circles(inner: bool) -> None:
    """In the middle of the contact the barrel is a circle of its radius; seen along the normal, so is the race."""
    contact = SlicedContact(
        geometry=geometry(), line=paper_scene().line_contact, roller_m=0.02, inner=inner, zone_rad=0.0,
        points_per_circle=500,
    )  # fmt: skip
    race = contact.radius_m / np.cos(geometry().tilt_rad) if inner else geometry().raceway_radius_m
    expected = 1 / 0.02 + (1 if inner else -1) / race
    assert contact.gap_curvature_1_m(np.zeros(1))[0] == pytest.approx(expected, rel=1e-9)


HOLE = {"kind": "outer", "shape": "hole", "extent": "2 mm", "height": "-0.5 mm"}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"defect": {"kind": "outer", "shape": "cosine", "extent": "2 mm"}}, "cosine"),
        ({"defect": HOLE | {"axial": "25 mm"}}, "beside the roller"),
        ({"defect": HOLE, "further_defects": [HOLE | {"angle": "0.2 deg"}]}, "a roller meets both"),
        ({"defect": HOLE | {"kind": "roller"}, "further_defects": [HOLE | {"kind": "roller"}]}, "two defects"),
    ],
)
def test_what_slices_cannot_tell_apart_is_refused(changes: dict[str, Any], words: str) -> None:
    scene: Scene = paper_scene(**changes)
    with pytest.raises(ConfigurationError, match=words):
        slice_parameters(scene, geometry())
