from __future__ import annotations

import pytest

from srbval.bench.ladder.questions import Question
from srbval.plan.reduction import Reduction
from srbval.plan.reductions import find_reductions
from srbval.scene import paper_scene


@pytest.fixture(scope="module")
def healthy() -> dict[str, Reduction]:
    scene = paper_scene(contact={"roller_fit": "printed"})
    found = find_reductions(scene, question=Question.LINES, tolerance_pct=0.5)
    return {reduction.name: reduction for reduction in found}


def test_every_reduction_is_shown_with_its_reason(healthy: dict[str, Reduction]) -> None:
    assert len(healthy) == 6
    assert all(reduction.why for reduction in healthy.values())


def test_what_changes_the_answer_too_much_is_not_taken() -> None:
    scene = paper_scene(defect={"kind": "outer"})
    found = find_reductions(scene, question=Question.AMPLITUDE, tolerance_pct=1e-9)
    coarser = next(r for r in found if r.name.startswith("output"))
    assert not coarser.taken
    assert coarser.difference_pct is not None
    assert coarser.difference_pct > 1e-9
    assert "beyond" in coarser.why
    rows = next(r for r in found if r.name.startswith("second row"))
    assert "more than" in rows.why, "a defect in one row breaks the symmetry"


def test_a_coarser_output_keeps_the_cage_speed(healthy: dict[str, Reduction]) -> None:
    (coarser,) = (r for r in healthy.values() if r.name.startswith("output"))
    assert coarser.taken
    assert coarser.difference_pct is not None
    assert coarser.difference_pct < 1e-3


def test_locked_tilts_keep_the_lines_of_a_healthy_bearing(healthy: dict[str, Reduction]) -> None:
    locked = healthy["locked cage tilts"]
    assert locked.difference_pct is not None
    assert locked.difference_pct < 0.5
    assert not locked.taken, "without kernels of its own there is nothing to gain"
