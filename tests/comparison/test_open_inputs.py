import pytest

from srbval.comparison.open_inputs import OpenInput, drawn, open_inputs
from srbval.errors import ConfigurationError
from srbval.scene import paper_scene

SCENE = paper_scene(defect={"kind": "outer"})


def test_every_input_of_the_paper_s_scene_changes_it_at_either_end():
    inputs = open_inputs()
    named = {key for each in inputs for key in each.keys}
    assert {"load.path", "contact.critical_velocity_m_s", "defect.extent_m", "band.low_hz"} <= named
    low, high = (drawn(inputs, SCENE, [share] * len(inputs)) for share in (0.0, 0.999))
    for key in named:
        assert read(low, key) != read(high, key), key
    assert all(each.source for each in inputs)


def read(made, key):
    scene, band = made
    if key.startswith("band."):
        return dict(zip(("band.low_hz", "band.high_hz"), band, strict=True))[key]
    for name in key.split("."):
        scene = getattr(scene, name)
    return scene


def test_choices_come_equally_often_and_take_their_other_values_with_them():
    load_path = next(each for each in open_inputs() if each.name == "load path")
    shares = [i / 100 for i in range(100)]
    assert [load_path.value(share) for share in shares].count("bearing") == 50
    scene = drawn([load_path], SCENE, [0.9])[0]
    assert (scene.load.path, scene.housing.damping_ns_m) == ("bearing", 0.0)
    assert drawn([load_path], SCENE, [None])[0] == SCENE


def test_a_key_that_no_scene_has_is_refused():
    with pytest.raises(ConfigurationError, match=r"has no fit"):
        drawn([OpenInput(name="made", source="s", keys=("contact.fit",), low=1.0, high=2.0)], SCENE, [0.5])
