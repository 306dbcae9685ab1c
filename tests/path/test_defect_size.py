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
from srbval.errors import ConfigurationError, DataError
from srbval.models.run import Run
from srbval.path import defect_size as module
from srbval.path.defect_size import FACTORS, DefectSize, Runs, defect_size, size_runs
from srbval.recordings import Recording
from srbval.scene import Scene, SensorPath, load_scene
from srbval.studies.simulated_rig import (
    BEARING,
    FS_HZ,
    LINE_HZ,
    SECONDS,
    SHAFT_HZ,
    TRUE,
    background,
    behind,
    record_of,
    run_with,
)

USUAL_M, TRUTH_M, SMALL_M = 2e-3, 3e-3, 1.5e-3  # the last without a dip in the band: its level says most
SPEED_M_S = 6.25  # of the contacts over the races, see `test_passage`
LEVEL_DB = 6.0


def ring(extent_m: float, level_db: float = 0.0) -> FloatArray:
    """Accelerations of a ring that loses a force as long as its contact passes a round hole: exact, by its spectrum."""
    hz = np.fft.rfftfreq(round(SECONDS * FS_HZ), 1 / FS_HZ)
    x = np.pi * np.maximum(hz, 1e-9) * extent_m / SPEED_M_S
    pulse = (extent_m / USUAL_M) ** 2 * 2 * j1(x) / x
    near = np.abs(hz - LINE_HZ * np.round(hz / LINE_HZ)) < 0.26  # of a line half a bin wide
    along = np.fft.irfft(400 * 10 ** (level_db / 20) * near * pulse * (hz > LINE_HZ / 2), n=round(SECONDS * FS_HZ))
    return np.column_stack([0 * along, along, 0 * along])  # the load pushes along y


def runs(drawn_db: tuple[float, ...] = ()) -> tuple[Runs, Runs]:
    """Those drawn strike harder by so much."""
    nominal = [(USUAL_M * f, run_with(Fault.OUTER, ring(USUAL_M * f))) for f in FACTORS]
    extents = (USUAL_M * np.geomspace(0.8, 1.2, len(drawn_db))).tolist()
    return nominal, [(e, run_with(Fault.OUTER, ring(e, db))) for e, db in zip(extents, drawn_db, strict=True)]


def faulty(extent_m: float, level_db: float = 0.0, noise: float = 0.02) -> Recording:
    shown = behind(ring(extent_m, level_db), TRUE)
    return record_of("OR", Fault.OUTER, shown + background(np.random.default_rng(2), noise))


def found(
    extent_m: float, level_db: float = 0.0, *, path: SensorPath = TRUE, drawn_db: tuple[float, ...] = (),
    noise: float = 0.02,
) -> DefectSize:  # fmt: skip
    return defect_size(faulty(extent_m, level_db, noise), runs(drawn_db), path, bearing=BEARING)


@pytest.fixture(scope="module")
def usual() -> DefectSize:
    return found(TRUTH_M)


def width(size: DefectSize, name: str) -> float:
    interval = size.sizes[name]
    return math.log((interval.high_m or size.simulated_m[-1]) / (interval.low_m or size.simulated_m[0]))


def test_a_size_is_recovered_and_a_wrong_one_rejected(usual: DefectSize) -> None:
    assert next(iter(usual.sizes)) == "shape alone"  # the one to quote
    for size in usual.sizes.values():
        assert size.extent_m == pytest.approx(TRUTH_M, rel=0.1)
        assert USUAL_M < size.low_m < TRUTH_M < size.high_m
    assert width(usual, "shape alone") > 1.1 * width(usual, "level and shape")
    assert not usual.path_is_fitted


def test_a_louder_record_has_a_larger_defect_by_its_level_and_the_same_by_its_shape() -> None:
    plain, louder = found(SMALL_M).sizes, found(SMALL_M, LEVEL_DB).sizes
    assert louder["shape alone"].extent_m == pytest.approx(plain["shape alone"].extent_m, rel=0.02)
    assert louder["level and shape"].extent_m > 1.1 * plain["level and shape"].extent_m


def test_inputs_that_change_the_level_make_the_size_by_level_less_sure_and_leave_the_shape() -> None:
    plain = found(SMALL_M)
    drawn = found(SMALL_M, path=dataclasses.replace(TRUE, used=("OR",)), drawn_db=(-12.0, 2.0, -6.0, 1.0))
    assert drawn.path_is_fitted
    assert width(drawn, "level and shape") > 1.2 * width(plain, "level and shape")
    assert drawn.sizes["shape alone"].extent_m == pytest.approx(plain.sizes["shape alone"].extent_m, rel=0.05)


def test_a_defect_lost_in_the_background_has_a_limit_by_its_level_and_none_by_its_shape() -> None:
    lost = found(1e-3, noise=0.1)
    assert lost.sizes["shape alone"].high_m is None
    assert lost.sizes["level and shape"].low_m is None
    assert lost.sizes["level and shape"].high_m is not None


def test_a_contact_passes_at_the_speed_of_pure_rolling(usual: DefectSize) -> None:
    """Of the cage over the outer race, where the roller touches it."""
    geometry = BEARING.geometry
    radius_m = geometry.raceway_radius_m * math.cos(geometry.tilt_rad)
    passage_s = usual.sizes["shape alone"].extent_m / (2 * math.pi * SHAFT_HZ * BEARING.orders.ftf * radius_m)
    assert usual.passage_s == pytest.approx(passage_s, rel=0.01)


def test_runs_are_of_all_sizes_and_the_drawn_ones_of_their_own_load(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[Recording, Scene]] = []

    def simulated(fault: Recording, scene: Scene, **_: object) -> Run:
        seen.append((fault, scene))
        return run_with(Fault.OUTER, np.zeros((8, 3)))

    monkeypatch.setattr(module, "simulated_run", simulated)
    fault = dataclasses.replace(faulty(TRUTH_M), radial_n=50e3)
    heavier = load_scene("rig", {"load": {"radial": "131.04 kN", "axial": "2 kN"}})  # 5 % more
    nominal, drawn = size_runs(fault, load_scene("rig"), [heavier])
    extents = [extent for extent, _ in (*nominal, *drawn)]
    assert extents == pytest.approx([*(USUAL_M * one for one in FACTORS), USUAL_M])
    assert [scene.defect.extent_m for _, scene in seen] == pytest.approx(extents)
    assert all(one.radial_n == 50e3 for one, _ in seen[:-1])
    assert (seen[-1][0].radial_n, seen[-1][0].axial_n) == pytest.approx((52.5e3, 2e3))
    assert {scene.steps_per_output for _, scene in seen} == {3}
    with pytest.raises(ConfigurationError, match="no extent"):
        size_runs(fault, load_scene("paper"))


def test_a_band_beyond_the_path_and_a_bearing_without_dimensions_are_refused() -> None:
    fault = faulty(TRUTH_M)
    with pytest.raises(ConfigurationError, match="give --band within"):
        defect_size(fault, runs(), TRUE, bearing=BEARING, band_hz=(300.0, 3000.0))
    with pytest.raises(DataError, match="a size needs 3"):
        defect_size(fault, runs(), TRUE, bearing=BEARING, band_hz=(1000.0, 1600.0))
    bare = dataclasses.replace(BEARING, geometry=None, elements=None)
    with pytest.raises(ConfigurationError, match="dimensions"):
        defect_size(fault, runs(), TRUE, bearing=bare)


def test_the_command(usual: DefectSize, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    fault = faulty(TRUTH_M)
    fitted = dataclasses.replace(usual, path_is_fitted=True)
    scenes: list[Scene] = []
    monkeypatch.setattr(identify_command, "_records", lambda *_: (fault, None, "skf-22240"))
    monkeypatch.setattr(identify_command, "size_runs", lambda _, scene, drawn, **__: scenes.extend([scene, *drawn]))
    monkeypatch.setattr(identify_command, "defect_size", lambda *_, **__: fitted)
    assert main(["identify", "OR.mat", "--defect-size", "rig"]) == 0
    said = capsys.readouterr().out
    assert "level and shape" in said
    assert f"{1e3 * usual.sizes['shape alone'].extent_m:.3g}" in said
    assert "identified from this record with an assumed size" in said
    assert len(scenes) == 1 + 2**identify_command.POWER
    assert main(["identify", "OR.mat", "--defect-size", "rig", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["sizes"]["level and shape"]["extent_m"] == usual.sizes["level and shape"].extent_m
    assert main(["identify", "OR.mat", "--defect-size", "none"]) == 2
    assert main(["identify", "OR.mat", "--defect-size", "rig", "-o", "path.toml"]) == 2
