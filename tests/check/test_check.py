"""A fresh run lies within every tolerance, and what must be caught is caught."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from srbval.check.check import CheckResult, ReferenceQuantity, read_reference, reference_path, run_check
from srbval.check.quantities import GROUPS
from srbval.models.full import parameters
from srbval.models.full.point_cloud import Circle
from srbval.scene import Scene, paper_scene

REFERENCE = read_reference(reference_path())
TEN_MICROMETRES = 1e-5


def failed(result: CheckResult) -> set[str]:
    return {check.name for check in result.checks if not check.ok}


def changed(contact: dict[str, float] | None = None, solver: str | None = None) -> Scene:
    base = paper_scene()
    base = replace(base, contact=replace(base.contact, **(contact or {})))
    return replace(base, solver=replace(base.solver, name=solver or base.solver.name))


@pytest.fixture
def without_recordings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("SRBVAL_RECORDINGS", raising=False)


@pytest.mark.usefixtures("without_recordings")
def test_what_needs_no_run_is_within_every_tolerance() -> None:
    """The runs too: `srbval check`, which `.ci/run` has behind the tests."""
    result = run_check(REFERENCE, groups=["kinematics", "statics", "rig"])
    assert failed(result) == set()
    assert set(result.skipped) == {"rig_order_outer", "rig_order_inner"}


@pytest.mark.recordings
def test_the_rigs_lines_are_within_their_tolerance(recordings_dir: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir / "torino"))
    result = run_check(REFERENCE, groups=["rig"])
    assert result.ok
    assert not result.skipped


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_contact_stiffness_off_by_two_per_cent_is_caught(factor: float) -> None:
    stiffness = factor * paper_scene().contact.stiffness_n_m
    assert "static_roller_share_play" in failed(
        run_check(REFERENCE, base=changed({"stiffness_n_m": stiffness}), groups=["statics"])
    )


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.9, pytest.param(1.1, marks=pytest.mark.long_form)])
def test_dynamic_friction_off_by_ten_per_cent_is_caught(factor: float) -> None:
    friction = factor * paper_scene().contact.dynamic_friction
    found = failed(run_check(REFERENCE, base=changed({"dynamic_friction": friction}), groups=["runs"]))
    assert {f"slip_power_w_{name}" for name in ("healthy", "outer", "inner", "outer_printed")} <= found


@pytest.mark.slow
def test_explicit_euler_is_caught() -> None:
    found = failed(run_check(REFERENCE, base=changed(solver="ode1"), groups=["runs"]))
    assert {"failed_runs", "slip_power_w_outer_printed", "band_rms_m_s2_outer_printed"} <= found


@pytest.mark.parametrize(("p", "sign"), [(0.5, -1), (1.0, 1), (1.5, -1)])
@pytest.mark.parametrize("race", ["outer_circle", "inner_circle"])
def test_a_circle_ten_micrometres_off_is_caught(
    race: str, p: float, sign: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    as_it_is: Callable[..., Circle] = getattr(parameters, race)

    def off(geometry: object, at: float) -> Circle:
        circle = as_it_is(geometry, at)
        return circle._replace(radius_m=circle.radius_m + sign * TEN_MICROMETRES) if at == p else circle

    monkeypatch.setattr(parameters, race, off)
    assert failed(run_check(REFERENCE, groups=["statics"]))


def test_a_quantity_without_a_reference_fails() -> None:
    result = run_check({}, groups=["kinematics"])
    assert failed(result) == {f"order_{name}" for name in ("bpfo", "bpfi", "bsf", "ftf")}


@pytest.mark.usefixtures("without_recordings")
def test_a_quantity_that_nothing_computes_any_more_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    kinematics = {name: GROUPS[name] for name in ("kinematics",)}
    monkeypatch.setattr("srbval.check.check.GROUPS", kinematics)
    gone = ReferenceQuantity(name="gone", value=1.0, tolerance=0.1, unit="1", reason="was there once")
    result = run_check({**REFERENCE, "gone": gone}, groups=["kinematics"])
    assert "gone" in failed(result)
    (check,) = [check for check in result.checks if check.name == "gone"]
    assert math.isnan(check.value)
