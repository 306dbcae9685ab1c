"""Formulas beside the runs in oil, and that every effect is a change of the scene's oil."""

import pytest

from srbval.scene import load_scene
from srbval.studies.oil_effects.study import EFFECTS, palmgren_power_w, skf_power_w

SKF_W = (1.6e3, 2.6e3)  # its model's range at 859 rpm, 124.8 kN, VG 150 at 60 degrees C, drag and series left open


def test_powers_of_the_formulas() -> None:
    oil = load_scene("rig-oil").oil
    assert oil is not None
    assert SKF_W[0] < skf_power_w(oil, 859.0, 124.8e3) < SKF_W[1]
    assert palmgren_power_w(oil, 859.0, 124.8e3) == pytest.approx(1.9e3, rel=0.3)  # 8 Nm of load, 11 to 15 viscous
    assert skf_power_w(oil, 859.0, 250e3) > skf_power_w(oil, 859.0, 124.8e3) > skf_power_w(oil, 340.0, 124.8e3)


def test_effects_are_changes_of_the_scenes_oil() -> None:
    scenes = {name: load_scene("rig-oil", {"oil": changes}) for name, changes in EFFECTS.items()}
    assert scenes["all"] == load_scene("rig-oil")
    assert len({str(scene.oil) for scene in scenes.values()}) == len(EFFECTS)
