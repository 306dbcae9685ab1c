"""Rungs measured in processes of their own; what was measured is not measured again."""

from dataclasses import replace
from pathlib import Path

import pytest

from srbval.plan.questions import Question
from srbval.storage.cache import KERNEL_VARIABLE, KERNELS, cache_folder
from srbval.studies.calibration_runs import measure_cases, quick_grid

SECONDS = 0.5
SLIP_PCT = 1.0  # slip, which the kinematic rung lacks, is less than one per cent


@pytest.mark.slow
def test_answers_are_kept_and_found_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(KERNEL_VARIABLE, str(cache_folder(KERNELS).parent))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    case = replace(quick_grid()[0], fit="printed")
    first, second = (measure_cases([case], models=("kinematic", "line"), seconds=SECONDS, jobs=1) for _ in range(2))
    assert len(list(tmp_path.rglob("ladder-*"))) == 3
    assert first == second, "costs too: nothing ran twice"
    rungs = first[0].levels
    assert 0 < rungs["kinematic"].wall_per_simulated_s < rungs["line"].wall_per_simulated_s  # type: ignore[operator]
    errors = [rungs[model].error_pct[Question.LINES] for model in ("line", "kinematic")]
    assert 0 < errors[0] < errors[1] < SLIP_PCT  # type: ignore[operator]
