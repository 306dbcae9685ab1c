"""Rungs measured in processes of their own; what was measured is not measured again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from srbval.bearing import load_bearing
from srbval.models.simulate import simulate
from srbval.path.amplitudes import HARMONICS, KURTOSIS_BANDS, RMS_BANDS, SIDEBANDS, THIRD_OCTAVES
from srbval.plan.questions import MEANING, Question, answers, error_pct
from srbval.recordings import recording_from_run
from srbval.scene import paper_scene
from srbval.studies.calibration_runs import answer_store, measure_cases, quick_grid

SECONDS = 0.5
SLIP_PCT = 1.0  # slip, which the kinematic rung lacks, is less than one per cent
ROUNDING = 1e-9  # the mean of many equal samples


@pytest.mark.slow
def test_answers_are_kept_and_found_again(tmp_path: Path) -> None:
    case = replace(quick_grid()[0], fit="printed")
    first, second = (
        measure_cases(
            [case],
            models=("kinematic", "line"),
            seconds=SECONDS,
            jobs=1,
            store=replace(answer_store(), folder=tmp_path),
        )
        for _ in range(2)
    )
    assert len(list(tmp_path.glob("ladder-*.json"))) == 3
    assert first == second, "costs too: nothing ran twice"
    rungs = first[0].levels
    assert 0 < rungs["kinematic"].wall_per_simulated_s < rungs["line"].wall_per_simulated_s  # type: ignore[operator]
    errors = [rungs[model].error_pct[Question.LINES] for model in ("line", "kinematic")]
    assert 0 < errors[0] < errors[1] < SLIP_PCT  # type: ignore[operator]


@pytest.mark.parametrize("kind", ["none", "outer", "inner"])
def test_lines_stand_where_the_cage_puts_them(kind: str) -> None:
    run = simulate(paper_scene(model="kinematic", duration="1 s", defect={"kind": kind}))
    found = answers(run, load_bearing("skf-22240"))[Question.LINES]
    assert found == pytest.approx((run.bpfi_hz if kind == "inner" else run.bpfo_hz,), rel=ROUNDING)


def test_amplitudes_are_those_that_are_compared_with_the_rig() -> None:
    known = {*RMS_BANDS, *THIRD_OCTAVES, *KURTOSIS_BANDS, "depth"}
    known |= {f"harmonic {n}" for n in HARMONICS} | {f"sidebands {n}" for n in SIDEBANDS}
    assert {name for meaning in MEANING.values() for name in meaning.read} == known
    run, healthy = (
        simulate(paper_scene(model="impulse", duration="1 s", defect={"kind": kind})) for kind in ("inner", "none")
    )
    bare = answers(run, load_bearing("skf-22240"))
    assert bare[Question.THIRD_OCTAVES] is None, "an increment is over something"
    found = answers(run, load_bearing("skf-22240"), recording_from_run(healthy))
    assert all(found[question] for question, meaning in MEANING.items() if meaning.read)


def test_three_decibels_are_41_per_cent_and_what_the_reference_does_not_show_is_not_asked() -> None:
    three = error_pct(Question.HARMONIC_LEVELS, (1.0, 9.0, -3.0), (1.0, None, 0.0))
    assert three == pytest.approx(41.25, abs=0.01)
    assert MEANING[Question.HARMONIC_LEVELS].text(three) == "3 dB"
    assert error_pct(Question.HARMONIC_LEVELS, (1.0, None), (1.0, 2.0)) is None, "what a rung does not show it lacks"
