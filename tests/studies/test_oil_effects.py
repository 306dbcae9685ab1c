"""Formulas beside the runs in oil, similar bearings, the onset of skidding, and what the page shows."""

import math
from pathlib import Path

import pytest

from srbval.bearing import load_bearing
from srbval.scene import load_scene, rig_inputs
from srbval.studies.oil_effects.study import (
    EFFECTS,
    OF_MINIMUM,
    ONSET_PCT,
    PITCH_MM,
    onset,
    onset_scenes,
    pairs,
    palmgren_power_w,
    scene_at,
    skf_power_w,
)

SKF_W = (1.6e3, 2.6e3)  # its model's range at 859 rpm, 124.8 kN, VG 150 at 60 degrees C, drag and series left open


def test_powers_of_the_formulas() -> None:
    oil = load_scene("rig-oil").oil
    assert oil is not None
    assert SKF_W[0] < skf_power_w(oil, 859.0, 124.8e3) < SKF_W[1]
    assert palmgren_power_w(oil, 859.0, 124.8e3) == pytest.approx(1.9e3, rel=0.3)  # 8 Nm of load, 11 to 15 viscous
    assert skf_power_w(oil, 859.0, 250e3) > skf_power_w(oil, 859.0, 124.8e3) > skf_power_w(oil, 340.0, 124.8e3)


def test_effects_stand_alone_and_pairs_differ_in_speed_only() -> None:
    bare, whole = (scene_at(859.0, 124.8, EFFECTS[name]) for name in ("none", "all"))
    assert whole.line_contact == load_scene("rig-oil").line_contact
    assert bare.line_contact == load_scene("rig").line_contact
    assert len({str((s.oil, s.line_contact)) for s in (scene_at(859.0, 124.8, e) for e in EFFECTS.values())}) == 6
    every = pairs()
    assert sum(key[0] == "range" for key in every) == 2 * len(rig_inputs("oil"))
    for changes, radial, axial in (pair for key, pair in every.items() if key[0] == "free"):
        scene = scene_at(859.0, radial, changes, axial)
        assert scene.bodies.free_rollers
        assert scene.load.axial_n < 15e3 or scene.solver.step_s < 1.3e-5
    assert {scene_at(rpm, 124.8, {}).duration_s * rpm for rpm in (340.0, 859.0)} == {180.0}


def test_similar_bearings_have_the_catalogues_load_of_their_size(tmp_path: Path) -> None:
    """A scene in oil, scaled: loads as the square of the size. SKF's 22220 has C_0 = 490 kN (from memory)."""
    found = dict(onset_scenes(tmp_path))
    ratings = load_bearing(str(tmp_path / "similar-22220.toml")).ratings
    assert ratings is not None
    assert ratings.static_load_n == pytest.approx(490e3, rel=0.03)
    half, whole = (found[name, 0.2, 1.0] for name in ("22220", "22240"))
    assert PITCH_MM["22240"] == 2 * PITCH_MM["22220"]
    assert half[1] == pytest.approx(whole[1] / 4) == pytest.approx(half[0].load.radial_n)
    assert half[0].shaft_speed_rad_s == pytest.approx(2 * whole[0].shaft_speed_rad_s)
    assert half[0].oil == whole[0].oil


def test_onset_is_where_slip_falls_below_its_limit() -> None:
    """Of a slip that falls as the load to the power of -3 exactly; nothing where it lies beyond the loads."""
    slips = [ONSET_PCT * (load / 0.5) ** -3 for load in OF_MINIMUM]
    assert onset(OF_MINIMUM, slips, ONSET_PCT) == pytest.approx(0.5, rel=1e-12)
    assert onset(OF_MINIMUM, [slip * 1e-3 for slip in slips], ONSET_PCT) is None
    assert math.isclose(ONSET_PCT, 1.0)
