"""The size of a defect behind a known path: on pulses whose length and height go with the size."""

import dataclasses
import json
import math

import numpy as np
import pytest
from scipy.special import j1

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.cli import identify_command, main
from srbval.errors import ConfigurationError
from srbval.models.sensor import SensorFilter
from srbval.path import defect_size as module
from srbval.path.defect_size import FACTORS, LEVEL_U_DB, DefectSize, Runs, defect_size, size_runs
from srbval.recordings import Recording
from srbval.scene import Scene, SensorPath, load_scene
from srbval.studies.simulated_rig import BEARING, FS_HZ, LINE_HZ, SECONDS, SHAFT_HZ, TRUE, background, missed, record

USUAL_M, TRUTH_M = 2e-3, 1.5e-3
SPEED_M_S = 6.25  # of the contacts over the races, see `test_passage`
NEAR = 0.2  # what a size is to be recovered to
LEVEL_DB = 3.0


def ring(extent_m: float, level_db: float = 0.0) -> FloatArray:
    """Accelerations of a ring that loses a force as long as its contact passes a round hole: exact, by its spectrum."""
    hz = np.fft.rfftfreq(round(SECONDS * FS_HZ), 1 / FS_HZ)
    x = np.pi * np.maximum(hz, 1e-9) * extent_m / SPEED_M_S
    pulse = (extent_m / USUAL_M) ** 2 * 2 * j1(x) / x
    near = np.abs(hz - LINE_HZ * np.round(hz / LINE_HZ)) < 0.5
    return np.fft.irfft(400 * 10 ** (level_db / 20) * near * pulse * (hz > LINE_HZ / 2), n=round(SECONDS * FS_HZ))


def runs(drawn_db: tuple[float, ...] = ()) -> tuple[Runs, Runs]:
    """Those drawn strike harder by so much."""
    extents = (USUAL_M * np.geomspace(0.8, 1.2, len(drawn_db))).tolist()
    nominal = {USUAL_M * f: record("run", Fault.OUTER, ring(USUAL_M * f)) for f in FACTORS}
    drawn = {e: record("drawn", Fault.OUTER, ring(e, level)) for e, level in zip(extents, drawn_db, strict=True)}
    return nominal, drawn


def records(extent_m: float, level_db: float = 0.0, seed: int = 1) -> tuple[Recording, Recording]:
    random = np.random.default_rng(seed)
    shown = SensorFilter(TRUE, FS_HZ).add(missed(random, ring(extent_m, level_db), 1.0))
    noise = [background(random, 0.02) for _ in range(2)]
    return record("OR", Fault.OUTER, shown + noise[0]), record("H", Fault.HEALTHY, noise[1])


def found(
    extent_m: float, level_db: float = 0.0, *, path: SensorPath = TRUE, drawn_db: tuple[float, ...] = ()
) -> DefectSize:
    return defect_size(*records(extent_m, level_db), runs(drawn_db), path, bearing=BEARING)


@pytest.fixture(scope="module")
def usual() -> DefectSize:
    return found(TRUTH_M)


def width(size: DefectSize, name: str = "level and shape") -> float:
    interval = size.sizes[name]
    return math.log(interval.high_m / interval.low_m)


def test_a_size_is_recovered_and_a_wrong_one_rejected(usual: DefectSize) -> None:
    assert set(usual.sizes) == set(LEVEL_U_DB)
    for size in usual.sizes.values():
        assert size.extent_m == pytest.approx(TRUTH_M, rel=NEAR)
        assert (size.low_m or 0) < TRUTH_M < (size.high_m or math.inf)
    whole = usual.sizes["level and shape"]
    assert whole.high_m < USUAL_M
    assert width(usual, "shape alone") > 1.2 * width(usual)
    assert not usual.path_is_fitted


def test_a_louder_record_has_a_larger_defect_by_its_level_and_the_same_by_its_shape(usual: DefectSize) -> None:
    """The force goes with the square of the size: the level alone would say 3 / 40 decades more."""
    louder = found(TRUTH_M, LEVEL_DB)
    shape = louder.sizes["shape alone"].extent_m
    assert shape == pytest.approx(usual.sizes["shape alone"].extent_m, rel=0.05)
    whole = louder.sizes["level and shape"]
    assert 1.05 * TRUTH_M < whole.extent_m < 1.1 * 10 ** (LEVEL_DB / 40) * TRUTH_M


def test_inputs_that_make_the_model_louder_make_the_size_smaller_and_less_sure(usual: DefectSize) -> None:
    fitted = dataclasses.replace(TRUE, used=("OR",))
    drawn = found(TRUTH_M, path=fitted, drawn_db=(LEVEL_DB, 2.0))
    assert drawn.path_is_fitted
    assert drawn.sizes["level and shape"].extent_m < 0.98 * usual.sizes["level and shape"].extent_m
    assert width(drawn) > 1.2 * width(usual)
    shape = drawn.sizes["shape alone"]
    assert shape.extent_m == pytest.approx(usual.sizes["shape alone"].extent_m, rel=0.05)


def test_a_contact_passes_at_the_speed_of_pure_rolling(usual: DefectSize) -> None:
    """Of the cage over the outer race, where the roller touches it."""
    geometry = BEARING.geometry
    radius_m = geometry.raceway_radius_m * math.cos(geometry.tilt_rad)
    passage_s = usual.sizes["level and shape"].extent_m / (2 * math.pi * SHAFT_HZ * BEARING.orders.ftf * radius_m)
    assert usual.passage_s == pytest.approx(passage_s, rel=0.01)


def test_runs_are_of_all_sizes_and_the_drawn_ones_of_their_own_load(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Recording, Scene]] = []

    def excitation(fault: Recording, scene: Scene, **_: object) -> Recording:
        seen.append((fault, scene))
        return record("run", Fault.OUTER, np.zeros(8))

    monkeypatch.setattr(module, "simulated_excitation", excitation)
    fault = dataclasses.replace(records(TRUTH_M)[0], radial_n=50e3)
    heavier = load_scene("rig", {"load": {"radial": "131.04 kN", "axial": "2 kN"}})  # 5 % more
    nominal, drawn = size_runs(fault, load_scene("rig"), [heavier])
    assert list(nominal) == pytest.approx([USUAL_M * one for one in FACTORS])
    assert list(drawn) == pytest.approx([USUAL_M])
    assert [scene.defect.extent_m for _, scene in seen] == pytest.approx([*nominal, *drawn])
    assert all(one.radial_n == 50e3 for one, _ in seen[:-1])
    assert (seen[-1][0].radial_n, seen[-1][0].axial_n) == pytest.approx((52.5e3, 2e3))
    assert {scene.steps_per_output for _, scene in seen} == {3}
    with pytest.raises(ConfigurationError, match="no extent"):
        size_runs(fault, load_scene("paper"))


def test_a_band_beyond_the_path_and_a_bearing_without_dimensions_are_refused() -> None:
    with pytest.raises(ConfigurationError, match="give --band within"):
        defect_size(*records(TRUTH_M), runs(), TRUE, bearing=BEARING, band_hz=(300.0, 3000.0))
    bare = dataclasses.replace(BEARING, geometry=None, elements=None)
    with pytest.raises(ConfigurationError, match="dimensions"):
        defect_size(*records(TRUTH_M), runs(), TRUE, bearing=bare)


def test_the_command(usual: DefectSize, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    fault, healthy = records(TRUTH_M)
    fitted = dataclasses.replace(usual, path_is_fitted=True)
    scenes: list[Scene] = []
    monkeypatch.setattr(identify_command, "_records", lambda _: (fault, healthy, "skf-22240"))
    monkeypatch.setattr(identify_command, "size_runs", lambda _, scene, drawn, **__: scenes.extend([scene, *drawn]))
    monkeypatch.setattr(identify_command, "defect_size", lambda *_, **__: fitted)
    assert main(["identify", "OR.mat", "--defect-size", "rig"]) == 0
    said = capsys.readouterr().out
    assert "level and shape" in said
    assert "1.5" in said
    assert "identified from this record with an assumed size" in said
    assert len(scenes) == 1 + 2**identify_command.POWER
    assert main(["identify", "OR.mat", "--defect-size", "rig", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["sizes"]["level and shape"]["extent_m"] == usual.sizes["level and shape"].extent_m
    assert main(["identify", "OR.mat", "--defect-size", "none"]) == 2
    assert main(["identify", "OR.mat", "--defect-size", "rig", "-o", "path.toml"]) == 2
