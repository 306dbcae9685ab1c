"""The waterfall: its steps make the rig's scene, what of the inputs acts where, and what its rows come to."""

import math
from typing import Any

import pytest

from srbval.bearing import Fault
from srbval.comparison.comparison import QuantityValue
from srbval.scene import load_scene
from srbval.studies.rig_amplitudes import NUMERICS, rows
from srbval.studies.waterfall.study import SECONDS, STEP_S, measures, steps, variants

NUMERIC: dict[str, Any] = {
    "duration": f"{SECONDS} s",
    "settle": "0.1 s",
    "shaft_speed": "859 rpm",
    "solver": {"step_s": STEP_S},
}


def test_the_steps_lead_from_the_papers_scene_to_the_rigs() -> None:
    first, *_, path, waves = steps()
    assert load_scene("paper", first.changes) == load_scene("paper")
    rig = {"sensor_path": "rig"} | NUMERIC
    assert load_scene("paper", {**path.changes, **NUMERIC}) == load_scene("rig", rig)
    rough = dict.fromkeys(("outer_waviness", "inner_waviness", "roller_waviness"), "28 nm")
    assert load_scene("paper", {**waves.changes, **NUMERIC}) == load_scene("rig", rig | {"surface": rough})
    scenes = [load_scene("paper", step.changes) for step in steps()]
    assert len(set(scenes)) == len(scenes), "each step changes something"


def test_an_input_acts_from_the_step_on_that_sets_it() -> None:
    first, last = (variants(step)[1][0] for step in (steps()[0], steps()[-1]))
    assert "radial" in first["load"]
    assert "radial_play" not in first.get("contact", {})
    assert "radial_play" in last["contact"]
    assert "row_stagger" in last["bodies"]


def test_measures_are_root_mean_squares_of_what_both_sides_show() -> None:
    rig = {name: QuantityValue(value=0.0) for name in ("harmonic 2", "harmonic 3", "harmonic 4", "sidebands 1")}
    model = {"harmonic 2": 3.0, "harmonic 3": -4.0, "harmonic 4": 99.0, "sidebands 1": -2.0}
    shown = {name: QuantityValue(value=value, present=value < 99) for name, value in model.items()}
    parts = {NUMERICS: dict.fromkeys(model, 1.0)}
    found = measures(rows(rig, shown, parts, record="IR", fault=Fault.INNER, used_for="withheld", scene="a"))
    harmonics, sidebands = found
    assert (harmonics["measure"], harmonics["shown"], harmonics["compared"]) == ("harmonics 2-5", 2, 3)
    assert harmonics["error"] == pytest.approx(math.sqrt(12.5))
    assert harmonics["uncertainty"] == pytest.approx(1.0)
    assert sidebands["error"] == -2.0  # of one quantity the sign stays
