"""Who is beaten by nobody."""

from __future__ import annotations

from srbval.plan.measures import MeasureErrors
from srbval.plan.timing import RunTiming
from srbval.studies.speed_accuracy.row import BenchRun
from srbval.studies.speed_accuracy.work_precision import non_dominated, with_pareto


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
