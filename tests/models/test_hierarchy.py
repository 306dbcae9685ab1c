"""What every level of the model hierarchy must do: one class, run on all of them."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from srbval import ConfigurationError, analyse, load_recording, recording_from_run, write_run
from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.models.hierarchy import MODELS, level_of
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.scene import Scene, SpeedProfile, load_scene, paper_scene

SECONDS = 1.0  # twelve revolutions
RESOLUTIONS = 2  # within which a line lies of the frequency of its own cage, whose speed varies a little
ROUNDING = 1e-12  # of a sum of two frequencies
RAMP = 0.005  # of the ratio of speeds at the ends: means over 20 samples
LINE_TOLERANCE = 0.005  # slip moves the lines by 0.25 %, a record of a second tells them to 0.1 %


def scene_of(model: str, kind: Fault, **changes: object) -> Scene:
    bodies = {"cages": 2 if model == "slices" else 1}  # whose kernels others use as well
    return paper_scene(model=model, duration_s=SECONDS, bodies=bodies, defect={"kind": kind}, **changes)


@pytest.fixture(scope="module", params=MODELS)
def model(request):
    return request.param


@pytest.fixture(scope="module")
def runs(model):
    return {kind: simulate(scene_of(model, kind), step=Step.UNCHECKED) for kind in RACE_DEFECTS}


@pytest.fixture(scope="module")
def analyses(runs):
    bearing = load_bearing("skf-22240")
    return {kind: analyse(recording_from_run(run), bearing=bearing) for kind, run in runs.items()}


class TestEveryLevel:
    """The standard tests of a model."""

    def test_it_ends_well(self, runs):
        for run in runs.values():
            assert run.status.usable, run.reason
            assert run.samples == run.scene.samples == len(run.acceleration_m_s2)

    def test_it_fills_what_it_says_and_nothing_else(self, model, runs):
        out = runs["outer"].out
        computed = np.isfinite(out).all(axis=0)
        assert np.flatnonzero(computed).tolist() == list(level_of(model).columns)
        assert np.isnan(out[:, ~computed]).all()

    @pytest.mark.parametrize("kind", RACE_DEFECTS)
    def test_its_fault_line_is_where_the_defect_and_its_own_cage_put_it(self, kind, runs, analyses):
        line = analyses[kind].line_of(kind)
        assert line.detected
        assert line.found_hz == pytest.approx(line.kinematic_hz, rel=LINE_TOLERANCE)
        run = runs[kind]
        own_hz = run.bpfo_hz if kind == "outer" else run.bpfi_hz
        assert line.found_hz == pytest.approx(own_hz, abs=RESOLUTIONS / SECONDS)
        assert run.bpfo_hz + run.bpfi_hz == pytest.approx(run.rolling_elements * run.scene.shaft_hz, rel=ROUNDING)
        assert not analyses[kind].line_of(Fault.INNER if kind is Fault.OUTER else Fault.OUTER).detected

    def test_the_same_scene_gives_the_same_run(self, model):
        scene = replace(scene_of(model, "inner"), duration_s=0.02, settle_s=0.01)
        first, again = (simulate(scene, step=Step.UNCHECKED) for _ in range(2))
        assert np.array_equal(first.acceleration_m_s2, again.acceleration_m_s2)

    def test_half_the_speed_halves_the_cage_speed(self, model, runs):
        scene = replace(scene_of(model, "outer", shaft_speed="355 rpm"), duration_s=0.1)
        slow = simulate(scene, step=Step.UNCHECKED)
        assert slow.cage_ratio == pytest.approx(runs["outer"].cage_ratio, rel=LINE_TOLERANCE)
        assert slow.cage_rad_s.mean() == pytest.approx(runs["outer"].cage_rad_s.mean() / 2, rel=LINE_TOLERANCE)

    def test_it_follows_a_speed_profile(self, model):
        ramp = SpeedProfile(time_s=(0.0, 0.1), speed_rad_s=(60.0, 66.0))
        scene = replace(scene_of(model, "outer"), duration_s=0.1, speed_profile=ramp)
        run = simulate(scene, step=Step.UNCHECKED)
        assert run.status.usable
        assert run.cage_rad_s[-20:].mean() / run.cage_rad_s[:20].mean() == pytest.approx(1.1, rel=RAMP)

    def test_files_hold_what_it_has(self, model, tmp_path):
        scene = replace(scene_of(model, "outer"), duration_s=0.05, detail_rate_hz=512.0)
        run = simulate(scene, step=Step.UNCHECKED)
        write_run(run, tmp_path / "run.h5")
        summary = simulate_to_file(scene, tmp_path / "streamed.h5", step=Step.UNCHECKED)
        assert (summary.cage_ratio, summary.status) == (run.cage_ratio, run.status)
        for name in ("run.h5", "streamed.h5"):
            assert np.array_equal(load_recording(tmp_path / name).channels["y"], run.acceleration_m_s2[:, 1])
        with h5py.File(tmp_path / "run.h5") as kept, h5py.File(tmp_path / "streamed.h5") as streamed:
            assert set(kept) == set(streamed)
            assert all(values.attrs["units"] and values.attrs["long_name"] for values in kept.values())
            assert all(np.array_equal(kept[name][()], streamed[name][()], equal_nan=True) for name in kept)


HOLE = {"kind": "outer", "shape": "hole", "extent": "2 mm", "height": "-0.5 mm"}
N3 = {"surface": {"roughness_class": "N3"}, "bodies": {"cages": 1}}
REFUSED = [
    *(("paper", {"model": name, "load": {"axial": "49 kN"}}, "axial") for name in ("impulse", "planar")),
    *(
        ("paper", {"model": name, "bodies": {"free_rollers": True}}, "does not simulate tilting rollers")
        for name in ("full", "line", "planar")
    ),
    *(
        ("rig", {"model": name, **N3}, rf"the model {name} does not simulate waves .* use --model line or slices")
        for name in MODELS
        if name not in ("line", "slices")
    ),
    ("rig", {"model": "full", "oil": {"iso_vg": 150}}, "does not simulate oil"),
    ("paper", {"model": "line", "defect": {"kind": "roller"}}, "full"),
    ("paper", {"defect": {"kind": "outer", "shape": "cosine", "extent": "2 mm"}}, "'cosine' is not known"),
    ("rig", {"defect": HOLE | {"axial": "25 mm"}}, "is not on the roller"),
    ("rig", {"defect": HOLE, "further_defects": [HOLE | {"angle": "0.2 deg"}]}, "a roller touches both"),
    ("rig", {"defect": HOLE | {"kind": "roller"}, "further_defects": [HOLE | {"kind": "roller"}]}, "two defects"),
]


@pytest.mark.parametrize(("base", "changes", "words"), REFUSED)
def test_a_model_refuses_what_it_does_not_know(base, changes, words):
    with pytest.raises(ConfigurationError, match=words):
        simulate(load_scene(base, changes | {"duration": "10 ms"}), step=Step.UNCHECKED)
