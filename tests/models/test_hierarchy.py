"""What every level of the model hierarchy must do: one class, run on all of them."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.hierarchy import MODELS, level_of
from srbval.models.run import Run
from srbval.models.run_file import write_run
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import load_recording, recording_from_run
from srbval.scene import Scene, SpeedProfile, paper_scene

SECONDS = 1.0  # twelve revolutions
RESOLUTIONS = 2  # within which a line lies of the frequency of its own cage, whose speed varies a little
ROUNDING = 1e-12  # of a sum of two frequencies
RAMP = 0.005  # of the ratio of speeds at the ends: means over 20 samples
LINE_TOLERANCE = 0.005  # slip moves the lines by 0.25 %, a record of a second tells them to 0.1 %


def scene_of(model: str, kind: Fault, **changes: object) -> Scene:
    return paper_scene(model=model, duration_s=SECONDS, defect={"kind": kind}, **changes)


@pytest.fixture(scope="module", params=MODELS)
def model(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def runs(model: str) -> dict[str, Run]:
    return {kind: simulate(scene_of(model, kind), step=Step.UNCHECKED) for kind in RACE_DEFECTS}


@pytest.fixture(scope="module")
def analyses(runs: dict[str, Run]) -> dict[str, Analysis]:
    bearing = load_bearing("skf-22240")
    return {kind: analyse(recording_from_run(run), bearing=bearing) for kind, run in runs.items()}


class TestEveryLevel:
    """The standard tests of a model."""

    def test_it_ends_well(self, runs: dict[str, Run]) -> None:
        for run in runs.values():
            assert run.status.usable, run.reason
            assert run.samples == run.scene.samples == len(run.acceleration_m_s2)

    def test_it_fills_what_it_says_and_nothing_else(self, model: str, runs: dict[str, Run]) -> None:
        run, columns = runs["outer"], level_of(model).columns
        for first, last, values in (
            (0, 3, run.acceleration_m_s2),
            (3, 6, run.displacement_m),
            (6, 7, run.cage_rad_s),
            (7, 9, run.cage_tilt_rad),
            (9, 12, run.roller_force_n),
            (12, 13, run.depth_m),
            (13, 14, run.energy.drive_w),
            (20, 21, run.energy.spring_j),
        ):
            if set(range(first, last)) <= set(columns):
                assert np.isfinite(values).all()
            else:
                assert np.isnan(values).all()

    @pytest.mark.parametrize("kind", RACE_DEFECTS)
    def test_its_fault_line_is_where_the_defect_and_its_own_cage_put_it(
        self, kind: Fault, runs: dict[str, Run], analyses: dict[str, Analysis]
    ) -> None:
        line = analyses[kind].line_of(kind)
        assert line.detected
        assert line.found_hz == pytest.approx(line.kinematic_hz, rel=LINE_TOLERANCE)
        run = runs[kind]
        own_hz = run.bpfo_hz if kind == "outer" else run.bpfi_hz
        assert line.found_hz == pytest.approx(own_hz, abs=RESOLUTIONS / SECONDS)
        assert run.bpfo_hz + run.bpfi_hz == pytest.approx(run.rolling_elements * run.scene.shaft_hz, rel=ROUNDING)
        other = analyses[kind].line_of(Fault.INNER if kind is Fault.OUTER else Fault.OUTER)
        assert not other.detected

    def test_the_same_scene_gives_the_same_run(self, model: str) -> None:
        scene = paper_scene(model=model, duration_s=0.02, settle_s=0.01, defect={"kind": "inner"})
        assert np.array_equal(simulate(scene).acceleration_m_s2, simulate(scene).acceleration_m_s2)

    def test_half_the_speed_halves_the_cage_speed(self, model: str, runs: dict[str, Run]) -> None:
        half = scene_of(model, "outer", shaft_speed="355 rpm")
        slow = simulate(replace(half, duration_s=0.1))
        assert slow.cage_ratio == pytest.approx(runs["outer"].cage_ratio, rel=LINE_TOLERANCE)
        assert slow.cage_rad_s.mean() == pytest.approx(runs["outer"].cage_rad_s.mean() / 2, rel=LINE_TOLERANCE)

    def test_it_follows_a_speed_profile(self, model: str) -> None:
        ramp = SpeedProfile(time_s=(0.0, 0.1), speed_rad_s=(60.0, 66.0))
        run = simulate(replace(scene_of(model, "outer"), duration_s=0.1, speed_profile=ramp))
        assert run.status.usable
        assert run.cage_rad_s[-20:].mean() / run.cage_rad_s[:20].mean() == pytest.approx(1.1, rel=RAMP)

    def test_files_hold_what_it_has(self, model: str, tmp_path: Path) -> None:
        scene = replace(scene_of(model, "outer"), duration_s=0.05, detail_rate_hz=512.0)
        run = simulate(scene)
        write_run(run, tmp_path / "run.h5")
        summary = simulate_to_file(scene, tmp_path / "streamed.h5")
        assert (summary.cage_ratio, summary.status) == (run.cage_ratio, run.status)
        for name in ("run.h5", "streamed.h5"):
            read = load_recording(tmp_path / name)
            assert np.array_equal(read.channels["y"], run.acceleration_m_s2[:, 1])
        with h5py.File(tmp_path / "run.h5") as kept, h5py.File(tmp_path / "streamed.h5") as streamed:
            assert set(kept) == set(streamed)
            assert all(np.array_equal(kept[name][()], streamed[name][()], equal_nan=True) for name in kept)


def test_levels_without_axial_motion_refuse_an_axial_load() -> None:
    for model in ("impulse", "planar"):
        with pytest.raises(ConfigurationError, match="axial"):
            simulate(scene_of(model, "outer", load={"axial": "49 kN"}))
