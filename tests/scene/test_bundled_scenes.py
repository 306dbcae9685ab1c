"""The scenes that are known by name, and the ranges of the rig's inputs."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest

from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError
from srbval.scene import (
    DefectShape,
    LoadPath,
    RigInput,
    Traction,
    load_scene,
    paper_scene,
    rig_inputs,
)
from srbval.scene.read import bundled_table

CLEARANCE_M = 92.5e-6  # the middle of the mounted clearance that the tables allow
# Of the gap at a roller; the scene's play has four digits, and the gap is not quite linear in the ring's displacement.
SAME_GAP = 1e-3
EXACT_RELATIVE = 1e-12  # rounding of a change of units
INPUTS = {one.key: one for one in rig_inputs()}


def keys_of(table: Mapping[str, Any], before: str = "") -> set[str]:
    """Dotted paths of all values of a table."""
    found = set()
    for key, value in table.items():
        found |= keys_of(value, f"{before}{key}.") if isinstance(value, Mapping) else {before + key}
    return found


def test_scenes_by_name() -> None:
    assert load_scene("paper") == paper_scene()
    rig = load_scene("rig", {"defect": {"kind": "outer"}})
    assert (rig.model, rig.load.path, rig.load.gravity) == ("slices", LoadPath.BEARING, True)
    assert rig.line_contact.traction is Traction.LUBRICATED
    assert 60 * rig.shaft_hz == pytest.approx(858.94, rel=EXACT_RELATIVE)
    (pit,) = rig.defects
    assert (pit.shape, pit.extent_m, pit.height_m, pit.axial_m) == (DefectShape.HOLE, 2e-3, -5e-4, 0.0)
    assert load_scene("rig").defects == ()
    assert rig.bodies.density_kg_m3 == paper_scene().bodies.density_kg_m3, "missing values are the paper's"


def test_a_file_of_a_scenes_name_needs_its_ending_or_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name in ("rig", "rig.toml"):
        Path(name).write_text('model = "kinematic"\n', encoding="utf-8")
    assert load_scene("rig").model == "slices"
    assert {load_scene(name).model for name in ("rig.toml", "./rig", tmp_path / "rig")} == {"kinematic"}


@pytest.mark.parametrize(
    ("name", "message"),
    [("rigg", "did you mean 'rig'"), ("papers", "did you mean 'paper'"), ("abc", "not known. Known: paper, rig")],
)
def test_unknown_names(name: str, message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        load_scene(name)


def test_the_play_at_a_roller_follows_from_the_rings_clearance() -> None:
    """A ring displaced by half its clearance just touches the roller in that direction, and is free by the play."""
    geometry = load_bearing("skf-22240").geometry
    play = load_scene("rig").contact.radial_play_m
    across = geometry.inner_centre_radial_m, geometry.inner_centre_axial_m  # from the outer sphere's centre

    def gap_m(displaced_m: float) -> float:  # between two arcs, along the line through their centres
        return 2 * geometry.raceway_radius_m - math.hypot(across[0] + displaced_m, across[1])

    assert gap_m(0.0) - gap_m(CLEARANCE_M / 2) == pytest.approx(play, rel=SAME_GAP)
    assert gap_m(0.0) == pytest.approx(geometry.zero_play_diameter_m, rel=SAME_GAP)


@pytest.mark.parametrize("key", INPUTS)
def test_each_input_is_the_scenes(key: str) -> None:
    """Its nominal value is the scene's, and every value of its range makes a scene."""
    one = INPUTS[key]
    assert load_scene("rig", one.changes(one.nominal)) == load_scene("rig")
    assert one.low <= one.nominal <= one.high
    for value in (one.low + share * (one.high - one.low) for share in one.shares):
        scene = load_scene("rig", one.changes(value))
        assert (scene == load_scene("rig")) == (value == one.nominal)
    assert one.stands_for
    assert one.source


def test_every_value_of_the_rigs_own_has_a_range_or_a_reason() -> None:
    own, reasons = keys_of(bundled_table("rig")), bundled_table("rig_inputs")["no_range"]
    assert own == set(INPUTS) - {"load.direction"} | set(reasons), "besides the direction, which is the paper's"
    assert not set(INPUTS) & set(reasons)
    assert all(reasons.values())


@pytest.mark.parametrize("wrong", [{"low": 2.0}, {"high": 0.5}, {"points": 1}, {"low": 1.0, "high": 1.0}])
def test_a_range_must_hold_its_nominal_value(wrong: dict[str, Any]) -> None:
    given: dict[str, Any] = {"low": 0.0, "high": 2.0, "points": 3} | wrong
    with pytest.raises(ConfigurationError, match="must rise"):
        RigInput(key="a", nominal=1.0, stands_for="", source="", **given)
