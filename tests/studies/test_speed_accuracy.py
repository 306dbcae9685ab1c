"""A benchmark from end to end, on runs too short to mean anything; no wall time is asserted."""

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from srbval.studies.speed_accuracy.measured import MeasureErrors, RunTiming, time_scene
from srbval.studies.speed_accuracy.reference import reference_store, references
from srbval.studies.speed_accuracy.row import BenchRun, row_of
from srbval.studies.speed_accuracy.targets import Target, speed_targets
from srbval.studies.speed_accuracy.work_precision import (
    non_dominated,
    observed_order,
    path_error,
    with_accuracy,
    with_pareto,
)

from srbval.bearing import Fault
from srbval.cli import main
from srbval.errors import ConfigurationError
from srbval.models.health import default_solver
from srbval.plan.measures import Measures
from srbval.scene import RollerFit
from srbval.storage.json_files import to_json
from srbval.storage.stored_result import SCHEMA_VERSION, ContentStore
from srbval.studies.scenes import QUICK, SCENES, BenchSettings, bench_scene, output_rate_hz
from srbval.studies.speed_accuracy import processes
from srbval.studies.speed_accuracy import study as bench
from srbval.studies.speed_accuracy.processes import Processes
from srbval.studies.speed_accuracy.study import BenchResult, run_bench, step_sizes

TINY = BenchSettings(
    timing_s=0.002, timing_settle_s=0.0, repeats=1, accuracy_s=0.01, accuracy_settle_s=0.0, memory_s=0.01, starts=1,
    reference_budget_s=0.0, window_s=0.001, steps=(61440,),
)  # fmt: skip
APART = Processes(
    compile_s=3.0, compile_by_solver_s={"ode4": 3.0}, second_start_s=2.5, peak_bytes=300_000_000, memory_seconds=10.0
)
ROW_KEYS = ("scene", "model", "solver", "dt_s", "wall_per_simulated_s", "cage_error", "noise_floor", "band_rms_error",
            "status", "pareto")  # fmt: skip


ROUNDING = 1e-9  # of a step that is one over a whole number
ONE_INTERVAL = 0.01  # 0.01 s are 205 output intervals: rounded to whole ones


def stored_in(folder: Path) -> ContentStore:
    return replace(reference_store(), folder=folder)


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> BenchResult:
    folder = tmp_path_factory.mktemp("references")
    return run_bench(
        scenes=("play0-outer",),
        solvers=("ode4", "imex2"),
        settings=TINY,
        processes=False,
        store=stored_in(folder),
    )


def test_scenes_are_what_their_names_say() -> None:
    assert len(SCENES) == 6
    scene = bench_scene("interference-inner", solver="ode3", seconds=1.0, settle_s=0.0)
    assert scene.contact.roller_fit is RollerFit.PRINTED
    assert scene.defect.kind is Fault.INNER
    assert bench_scene("play0-healthy", solver="ode4", seconds=1.0, settle_s=0.0).defect.kind is Fault.HEALTHY
    with pytest.raises(ConfigurationError, match="play0-outer"):
        bench_scene("play1-outer", solver="ode4", seconds=1.0, settle_s=0.0)


@pytest.mark.parametrize(("per_second", "rate"), [(61440, 20480), (20480, 20480), (30720, 15360), (7680, 7680)])
def test_output_rate_suits_the_step(per_second: int, rate: float) -> None:
    assert output_rate_hz(1 / per_second) == pytest.approx(rate)


def test_document(result: BenchResult) -> None:
    document = to_json(result)
    assert {"machine", "reference", "runs", "trajectories", "processes", "targets"} <= set(document)
    assert {"processor", "cores", "versions", "load_before", "calibration"} <= set(document["machine"])
    assert [r["solver"] for r in document["runs"]] == ["ode4", "imex2"]
    for row in document["runs"]:
        assert set(ROW_KEYS) <= set(row)
        assert row["wall_in_calibrations"] == pytest.approx(
            row["wall_per_simulated_s"] / document["machine"]["calibration"]["seconds"]
        )
    assert document["runs"][0]["rhs_per_simulated_s"] == pytest.approx(4 * 61440)
    reference = document["reference"]["play0-outer"]
    assert reference["dt_s"] == pytest.approx(1 / 122880)
    assert {"own_cage_error", "own_band_rms_error", "cached"} <= set(reference)
    assert any(r["pareto"] for r in document["runs"])


def test_reference_is_kept_and_said_to_be(tmp_path: Path) -> None:
    first = references(["play0-outer"], TINY, store=stored_in(tmp_path))["play0-outer"]
    again = references(["play0-outer"], TINY, store=stored_in(tmp_path))["play0-outer"]
    assert (first.cached, again.cached) == (False, True)
    assert again.to_dict() | {"cached": False} == first.to_dict()
    (kept,) = tmp_path.iterdir()
    kept.write_text("half a fi")
    assert not references(["play0-outer"], TINY, store=stored_in(tmp_path))["play0-outer"].cached


def test_failed_reference_is_said_and_not_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("srbval.studies.speed_accuracy.reference.default_solver", lambda: "ode9")
    found = references(["play0-outer"], TINY, store=stored_in(tmp_path))["play0-outer"]
    assert (found.status, found.measures) == ("refused", None)
    assert found.to_dict()["cage_ratio"] is None
    assert not list(tmp_path.iterdir())


def test_failed_run_stays_a_row(tmp_path: Path) -> None:
    """Euler at three times the paper's step throws its rollers clear; an unknown method is not begun."""
    settings = replace(TINY, accuracy_s=0.2)
    scene = bench_scene("play0-outer", solver="ode1", step_s=1 / 20480, seconds=0.002, settle_s=0.0)
    unknown = bench_scene("play0-outer", solver="ode9", seconds=0.002, settle_s=0.0)
    rows = [row_of("play0-outer", time_scene(s, 1), 0.05) for s in (scene, unknown)]
    found = references(["play0-outer"], TINY, store=stored_in(tmp_path))
    thrown, refused = with_accuracy(rows, found, settings)
    assert not thrown.ok
    assert thrown.reason
    assert (refused.status, refused.wall_per_simulated_s) == ("refused", None)
    for row in (thrown, refused):
        document = row.to_dict()
        assert set(ROW_KEYS) <= set(document)
        assert (document["cage_error"], document["pareto"]) == (None, False)


def test_reference_is_not_held_against_itself(tmp_path: Path) -> None:
    """Its error would be zero, and the best on the chart."""
    found = references(["play0-outer"], TINY, store=stored_in(tmp_path))
    itself = bench_scene("play0-outer", solver=default_solver(), step_s=1 / 122880, seconds=0.002, settle_s=0.0)
    (row,) = with_accuracy([row_of("play0-outer", time_scene(itself, 1), 0.05)], found, TINY)
    assert row.ok
    assert (row.errors, row.pareto, row.cage_error_bound) == (None, False, None)


def test_error_below_the_references_own_is_said_to_be(result: BenchResult) -> None:
    row = result.runs[0]
    assert row.errors is not None
    lucky = replace(row, errors=replace(row.errors, cage_error=1e-12))
    own = result.references["play0-outer"].own_errors
    assert own is not None
    assert (lucky.reference_limited, lucky.cage_error_bound) == (True, own.cage_error)


def test_targets_are_shown_met_or_not() -> None:
    targets = {t.name: t for t in speed_targets([], APART)}
    assert targets["compile, empty store"].met is True
    assert targets["second srbval simulate --seconds 0.1"].met is False
    assert targets["peak memory of a 10 s run"].value == 300.0
    assert targets["full model, ode4 at 1/61440 s, play0-outer"].met is None
    failed = Target(name="x", value=None, limit=1.0, unit="s", attempted=True)
    assert failed.met is False, "a failed run does not meet its target"
    assert to_json(Target(name="x", value=1.0, limit=1.0, unit="s"))["met"] is True


def test_observed_order() -> None:
    assert observed_order((1.0, 0.4, 0.1)) == pytest.approx(2.0)
    assert observed_order((1.0, 0.4, None)) is None


def test_path_error() -> None:
    import numpy as np

    path = np.array([[0.0, 1.0], [0.0, -1.0]])
    assert path_error(path, path) == 0.0
    assert path_error(path * 1.5, path) == pytest.approx(0.5)


def test_default_step_is_among_the_steps() -> None:
    of_rig = 1 / 40960
    steps = step_sizes(QUICK, [of_rig], accuracy=True)
    assert steps == sorted(steps, reverse=True)
    assert of_rig in steps
    assert any(abs(s * 61440 - 1) < ROUNDING for s in step_sizes(TINY, [of_rig], accuracy=False))
    assert step_sizes(QUICK, [1 / 61440, 1 / 61440], accuracy=True) == step_sizes(QUICK, [], accuracy=True)


def test_processes_read_their_children(monkeypatch: pytest.MonkeyPatch) -> None:
    def answer(_store: Path, *arguments: str) -> str:
        if "compile" in arguments:
            return json.dumps({"compile_s": 2.0, "by_solver": {"ode4": 2.0}})
        return json.dumps({"seconds": 0.01, "peak_bytes": 5}) if "memory" in arguments else "{}"

    monkeypatch.setattr(processes, "_run", answer)
    found = processes.measure_processes(TINY)
    assert (found.compile_s, found.peak_bytes, found.memory_seconds) == (2.0, 5, 0.01)


def test_child_prints_one_document() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "srbval.studies.speed_accuracy.child", "memory", "0.01"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert json.loads(done.stdout)["seconds"] == pytest.approx(0.01, rel=ONE_INTERVAL)


@pytest.mark.parametrize("extra", [["--speed-only", "--json"], ["--json"], []])
def test_command(
    extra: list[str], capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(bench, "QUICK", TINY)
    monkeypatch.setattr(bench, "measure_processes", lambda *_: APART)
    monkeypatch.setattr("srbval.storage.stored_result.cache_folder", lambda kind: tmp_path / kind)
    code = main(["bench", "--quick", "--scenes", "play0-healthy", "--solvers", "ode4", *extra])
    said = capsys.readouterr()
    assert code == 0
    assert "Speed accuracy: time the solvers" in said.err
    if "--json" not in extra:
        assert "NOT MET" not in said.out  # a first impression is no verdict
        assert "verdict" not in said.out
        assert "reference" in said.out
        return
    document: dict[str, Any] = json.loads(said.out)
    assert (document["status"], document["schema_version"]) == ("ok", SCHEMA_VERSION)
    assert bool(document["reference"]) is ("--speed-only" not in extra)
    assert all(set(ROW_KEYS) <= set(row) for row in document["runs"])
    assert document["targets"] == []


def test_unknown_names_are_wrong_use(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "--scenes", "nowhere"]) == 2
    assert main(["bench", "--solvers", "ode9"]) == 2
    assert "ode4" in capsys.readouterr().err


def test_measures_have_no_floor_of_a_short_record(result: BenchResult) -> None:
    measures = result.runs[1].measures
    assert isinstance(measures, Measures)
    assert measures.noise_floor is None


def test_front() -> None:
    points = [(1.0, 4.0), (2.0, 2.0), (4.0, 1.0), (3.0, 3.0), (2.0, 2.5), None]
    assert non_dominated(points) == [True, True, True, False, False, False]


def test_equals_do_not_beat_each_other() -> None:
    assert non_dominated([(1.0, 1.0), (1.0, 1.0), (1.0, 2.0)]) == [True, True, False]


def row(scene: str, wall: float, cage: float, band: float, status: str = "ok") -> BenchRun:
    return BenchRun(
        scene=scene, model="full", solver="ode4", dt_s=1e-5, status=status, reason="", calibration_s=0.05,
        timing=RunTiming(best=wall, median=wall, repeats=1, core_share=1.0),
        errors=MeasureErrors(cage_error=cage, defect_hz_error=None, noise_floor_ratio=None, band_rms_error=band,
                      harmonic_error=None),
    )  # fmt: skip


def test_each_scene_has_its_own_front_and_failed_runs_are_on_none() -> None:
    rows = [
        row("play0-outer", 1.0, 1e-4, 0.1),
        row("play0-outer", 2.0, 1e-5, 0.2),
        row("play0-outer", 0.1, 0.0, 0.0, status="cage-lost"),
        row("interference-outer", 9.0, 1e-1, 0.9),
    ]
    flagged = with_pareto(rows)
    assert [r.pareto for r in flagged] == [True, True, False, True]
    assert [r.pareto_band for r in flagged] == [True, False, False, True]
    assert [r.status for r in flagged] == [r.status for r in rows]
