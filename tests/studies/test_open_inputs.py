import pytest

from srbval.errors import ConfigurationError
from srbval.scene import paper_scene
from srbval.studies.open_inputs import OpenInput, drawn, open_inputs

SCENE = paper_scene(defect={"kind": "outer"})


def one(**changes):
    return OpenInput(name="made", source="s", **({"keys": ("load.radial_n",), "low": 1.0, "high": 2.0} | changes))


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


def test_choices_come_as_often_as_their_weights():
    path = one(keys=("load.path",), choices=("housing", "bearing"), weights=(0.75, 0.25))
    shares = [i / 100 for i in range(100)]
    assert [path.value(share) for share in shares].count("bearing") == 25
    assert {path.coordinate(share) for share in shares} == {0.0, 1.0}
    assert drawn([path], SCENE, [0.9])[0].load.path == "bearing"


@pytest.mark.parametrize(
    "wrong", [{"low": 2.0, "high": 1.0}, {"log": True, "low": 0.0}, {"choices": ("a", "b"), "weights": (0.5, 0.6)}]
)
def test_a_range_that_is_none_is_refused(wrong):
    with pytest.raises(ConfigurationError, match="made"):
        one(**wrong)
