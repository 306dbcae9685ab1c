"""The study of the rig scene's inputs: what it runs, what it reckons, and its stored result."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from srbval.bearing import Fault
from srbval.check.check import read_reference, reference_path
from srbval.errors import NumericsError
from srbval.models.run import RunStatus
from srbval.models.simulate import Step
from srbval.scene import draws, load_scene, rig_inputs
from srbval.storage.stored_result import newest_result
from srbval.studies.rig_inputs import study as calibrator
from srbval.studies.rig_inputs.study import (
    AGREE,
    BEARING,
    RECORDS,
    RESOLVED,
    UNDECIDED,
    InputEffect,
    InputStudy,
    RigLine,
    cage_ratio,
    effect_rows,
    read_again,
    rig_line,
    stored_line,
    study_inputs,
    summary_row,
)

ROUNDING = 1e-9
# Between the runs of two machines: rounding grows while contacts open and close, as between perturbed starts.
SAME_RATIO = 2e-6
ALLOWED_PCT = 0.05  # of the cage ratio, between model and rig at 858 rpm: what the project asks of the rig scene
READ = 1e-6  # of the cage ratio, between the reading of two machines
OUTER = RigLine(
    record="OR 877", line="BPFO", kind=Fault.OUTER, rpm=858.940, cage_ratio=0.43082, standard_uncertainty=3e-5
)
INNER = RigLine(
    record="IR 877", line="BPFI", kind=Fault.INNER, rpm=854.888, cage_ratio=0.43068, standard_uncertainty=6e-5
)
WITHOUT_INTERVAL = replace(OUTER, standard_uncertainty=None)
INPUTS = rig_inputs()


def study(line: RigLine = OUTER, *, off: float = 0.0, half_spread: float = 1e-4, drawn: float = 0.0) -> InputStudy:
    """One whose nominal ratio is `off` the rig's, with known effects: of two inputs alone, and `drawn` together."""
    nominal = line.cage_ratio + off
    effect = InputEffect(
        key="a", unit="", values=(0.0, 1.0, 2.0),
        cage_ratios=(nominal, nominal + 2 * half_spread, nominal + half_spread),
    )  # fmt: skip
    return InputStudy(
        of=line, nominal=nominal, finer=nominal, starts=(nominal, nominal), effects=(effect, effect),
        drawn=(nominal - drawn, nominal + drawn),
    )  # fmt: skip


def test_inputs_add_up_by_squares_and_effects_need_not_be_monotone() -> None:
    found = study(half_spread=1e-4)
    assert found.effects[0].half_spread == pytest.approx(1e-4, rel=ROUNDING)
    assert found.parts_pct["inputs"] == pytest.approx(100 * math.sqrt(2) * 1e-4 / 0.43082, rel=ROUNDING)
    assert found.parts_pct["numerics"] == 0.0
    assert found.parts_pct["data"] == pytest.approx(100 * 2 * 3e-5 / 0.43082, rel=ROUNDING)
    assert found.uncertainty_pct == pytest.approx(
        math.hypot(found.parts_pct["inputs"], found.parts_pct["data"]), rel=ROUNDING
    )


def test_inputs_that_do_more_together_count_as_they_do_together() -> None:
    found = study(half_spread=1e-4, drawn=1e-3)
    together = found.parts_pct["inputs together"]
    assert together == pytest.approx(0.95 * 100 * 1e-3 / 0.43082, rel=ROUNDING)  # of two draws, 2.5 to 97.5 %
    assert found.uncertainty_pct == pytest.approx(math.hypot(together, found.parts_pct["data"]), rel=ROUNDING)


def test_a_cage_that_turns_faster_raises_one_line_and_lowers_the_other() -> None:
    outer, inner = study(OUTER, off=1e-4), study(INNER, off=1e-4)
    assert outer.error_pct == pytest.approx(100 * 1e-4 / 0.43082, rel=ROUNDING)
    assert inner.error_pct == pytest.approx(-100 * 1e-4 / (1 - 0.43068), rel=ROUNDING)


@pytest.mark.parametrize(
    ("off", "half_spread", "verdict"),
    [(0.0, 1e-5, AGREE), (1e-3, 1e-5, RESOLVED), (0.0, 1e-3, UNDECIDED), (1e-3, 1e-3, UNDECIDED)],
)
@pytest.mark.parametrize("line", [OUTER, INNER], ids=lambda line: line.line)
def test_verdicts(line: RigLine, off: float, half_spread: float, verdict: str) -> None:
    found = study(line, off=off, half_spread=half_spread)
    assert found.verdict == summary_row(found)["verdict"] == verdict


def test_what_has_no_interval_is_not_judged() -> None:
    found = study(WITHOUT_INTERVAL)
    assert (found.verdict, found.uncertainty_pct) == (None, None)
    assert "data" not in found.parts_pct


def test_inputs_are_drawn_within_their_ranges() -> None:
    drawn = draws(INPUTS, 4)
    assert draws(INPUTS, 4) == drawn
    directions = {changes["load"]["direction"] for changes in drawn}
    assert directions == {"-90.0 deg", "90.0 deg"}, "one or the other"
    for changes in drawn:
        line, load = changes["line_contact"], changes["load"]
        assert 0.96 <= line["outer_osculation"] <= 0.985
        assert 2 <= line["traction_slope"] <= 5
        assert 118.6 <= float(load["radial"].removesuffix(" kN")) <= 131
    assert len({changes["line_contact"]["traction_slope"] for changes in drawn}) == len(drawn)


def test_runs_are_of_the_rig_scene(monkeypatch: pytest.MonkeyPatch) -> None:
    """With the record's speed and defect; every value of every input is run, and every draw."""
    scenes = []

    class Ran:
        status = RunStatus.OK
        cage_ratio = 0.43

    def run(scene: object, *, step: Step) -> Ran:
        assert step is Step.UNCHECKED
        scenes.append(scene)
        return Ran()

    monkeypatch.setattr(calibrator, "simulate", run)
    found = study_inputs(INNER, INPUTS, drawn=2)
    rows = effect_rows(found)
    assert [row["input"] for row in rows] == [one.key for one in INPUTS]
    assert len(scenes) == sum(one.points for one in INPUTS) + 2**2 + 2 + calibrator.STARTS
    assert {(s.model, s.defect.kind, round(60 * s.shaft_hz, 3)) for s in scenes} == {  # type: ignore[attr-defined]
        ("slices", Fault.INNER, 854.888)
    }
    assert (found.nominal, found.finer, found.drawn_interval) == (0.43, 0.43, (0.43, 0.43))


def test_a_failed_run_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    class Failed:
        status = RunStatus.ENERGY_OPEN
        reason = "energy does not close"

    monkeypatch.setattr(calibrator, "simulate", lambda _, **__: Failed())
    with pytest.raises(NumericsError, match=r"seed.*energy does not close"):
        cage_ratio(OUTER, {"seed": 1})


def test_the_stored_result_is_of_the_scene_and_keeps_what_is_asked_for() -> None:
    """The whole study, run by ``srbval study run rig_inputs``."""
    kept = newest_result("rig_inputs")
    if kept is None:
        pytest.skip("no stored result; srbval study run rig_inputs makes one")
    studies = kept.content["studies"]
    assert [each["of"]["record"] for each in studies] == list(RECORDS)
    for each in studies:
        assert {e["key"]: tuple(e["values"]) for e in each["effects"]} == {one.key: one.values for one in INPUTS}
    for each in studies[:2]:
        assert abs(100 * (each["nominal"] / each["of"]["cage_ratio"] - 1)) < ALLOWED_PCT
        assert abs(each["error_pct"]) < each["uncertainty_pct"]


@pytest.mark.parametrize("record", RECORDS)
def test_the_stored_lines_are_those_of_the_reference(record: str) -> None:
    """As ``srbval check`` reads them, or those published."""
    if newest_result("rig_inputs") is None:
        pytest.skip("no stored result; srbval study run rig_inputs makes one")
    kept, (_, kind, published) = stored_line(record), RECORDS[record]
    assert kept == rig_line(record), "without recordings"
    if published is None:
        order, checked = BEARING.rolling_elements * kept.share(kept.cage_ratio), read_reference(reference_path())
        assert order == pytest.approx(checked[f"rig_order_{kind}"].value, abs=checked[f"rig_order_{kind}"].tolerance)


@pytest.mark.parametrize("record", ["OR 877", "IR 877"])
def test_the_stored_lines_are_the_recordings(
    record: str, recordings_dir: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    if newest_result("rig_inputs") is None:
        pytest.skip("no stored result; srbval study run rig_inputs makes one")
    monkeypatch.setenv("SRBVAL_RECORDINGS", str(recordings_dir))
    kept, read = stored_line(record), rig_line(record)
    assert kept.rpm == read.rpm
    assert kept.cage_ratio == pytest.approx(read.cage_ratio, abs=READ)
    assert kept.standard_uncertainty == pytest.approx(read.standard_uncertainty, abs=READ)


def test_reading_again_keeps_the_runs() -> None:
    kept = newest_result("rig_inputs")
    if kept is None:
        pytest.skip("no stored result; srbval study run rig_inputs makes one")
    for each in kept.content["studies"]:
        found = read_again(each)
        assert (found.nominal, list(found.drawn)) == (each["nominal"], each["drawn"])
        assert found.error_pct == pytest.approx(each["error_pct"], abs=100 * READ)


@pytest.mark.slow
def test_some_of_it_measured_anew() -> None:
    kept = newest_result("rig_inputs")
    if kept is None:
        pytest.skip("no stored result; srbval study run rig_inputs makes one")
    for each in kept.content["studies"][1:3]:  # one of either race, at either speed
        assert cage_ratio(stored_line(each["of"]["record"]), {}) == pytest.approx(each["nominal"], abs=SAME_RATIO)
    outer = kept.content["studies"][0]["effects"][0]
    assert outer["key"] == INPUTS[0].key
    assert cage_ratio(OUTER, INPUTS[0].changes(INPUTS[0].high)) == pytest.approx(
        outer["cage_ratios"][-1], abs=SAME_RATIO
    )


def test_the_scenes_own_step_is_fine_at_its_nominal_values() -> None:
    """The study runs with a shorter one; the scene's own gives the same cage speed."""
    step_s = load_scene("rig").solver.step_s
    assert cage_ratio(OUTER, {"solver": {"step_s": step_s}}) == pytest.approx(cage_ratio(OUTER, {}), abs=SAME_RATIO)
