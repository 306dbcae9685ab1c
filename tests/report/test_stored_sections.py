"""Sections of stored results: what they show, that failures stay visible, what stands where nothing is stored."""

from __future__ import annotations

import itertools
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from srbval.report.blocks import Callout, Figure, Listing, Paragraph
from srbval.report.findings.stored import ShownResult, shown_result
from srbval.report.table import Table
from srbval.scene import paper_scene
from srbval.storage.stored_result import StoredResult
from srbval.studies.reading_accuracy.page import TEXTS as READING_TEXTS
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.speed_accuracy.page import speed_accuracy_section
from srbval.studies.stability.page import stability_section

DEFAULT = paper_scene().solver
NO_BENCH, NO_MAP = shown_result("rig_speed_accuracy", None), shown_result("rig_stability", None)
NO_VERDICTS = shown_result("own_verdicts", None)
STEPS, RPM = (61440, 30720, 7680), (127.0, 3000.0)
ORIGIN = {"made_utc": "2026-01-01T00:00:00+00:00", "git_revision": "abc", "command": "srbval stability",
          "machine": {"processor": "A & <B>", "usable_cores": 2}}  # fmt: skip


def cell(solver: str, velocity: float, steps: int, rpm: float) -> dict[str, Any]:
    status = {61440: "ok", 30720: "unlike-reference", 7680: "too-deep"}[steps]
    return {
        "scene": "play0-outer", "model": "full", "solver": solver, "dt_s": 1 / steps, "rpm": rpm,
        "critical_velocity_m_s": velocity, "status": status, "reason": "because", "stable": status == "ok",
        "predicted_limit_dt_s": 1e-8 if velocity < 0.1 else None, "predicted_elastic_limit_dt_s": 1e-4,
        "cage_error": 0.02, "load_part": 1.3,
    }  # fmt: skip


@pytest.fixture
def stability() -> ShownResult:
    cells = [cell(*c) for c in itertools.product(("ode1", "imex2"), (0.001, 0.5), STEPS, RPM)]
    grid = {
        "scenes": ["play0-outer"], "solvers": ["ode1", "imex2"], "steps_per_s": list(STEPS), "rpm": list(RPM),
        "critical_velocity_m_s": [0.001, 0.5], "seconds": 0.2, "passages": 4.0, "reference_steps_per_s": 983040,
    }  # fmt: skip
    content = ORIGIN | {
        "grid": grid,
        "cells": cells,
        "counts": {"cells": 24, "ok": 8, "stable": 8, "inaccurate": 0, "caught_by_the_run": 8,
                   "seen_by_comparison_only": 8,
                   "flagged_with_cage_and_load_right": 0},
        "claims": [{"claim": "A *claim*.", "borne_out": False, "answer": "No.", "evidence": ["ode1: `so`"]}],
        "planted": [{"caught": True}, {"caught": False}],
        "references": [{"own_cage_error": 1e-6, "own_load_error": 1e-2, "status": "ok"}],
    }  # fmt: skip
    return shown_result("stability", StoredResult(path=Path("stability.json"), content=content))


def run(solver: str, steps: int, status: str, **changes: Any) -> dict[str, Any]:
    ok = status == "ok"
    return {
        "scene": "play0-outer", "solver": solver, "dt_s": 1 / steps, "wall_per_simulated_s": 1.0 + steps / 61440,
        "cage_error": 1e-4 if ok else None, "band_rms_error": 0.1 if ok else None, "noise_floor": 1e-3 if ok else None,
        "harmonic_error": 0.1 if ok else None, "status": status, "reason": "because", "pareto": False,
        "reference_limited": False,
    } | changes  # fmt: skip


@pytest.fixture
def speed_accuracy() -> ShownResult:
    content = ORIGIN | {
        "runs": [
            run(DEFAULT.name, round(1 / DEFAULT.step_s), "ok", cage_error=1e-6, pareto=True),
            run("ode4", round(1 / PAPER_STEP_S), "ok"),
            run("ode1", 61440, "load-lost"),
            run("ode1", 30720, "not-finite", wall_per_simulated_s=None),
            run("ode3", 122880, "ok"),
        ],
        "trajectories": [
            {"scene": scene, "solver": solver, "observed_order": order, "reference_error": error, "window_s": 0.02}
            for scene, error in (("interference-outer", 1e-3), ("play0-outer", 0.3))
            for solver, order in (("ode4", None), (DEFAULT.name, 1.5))
        ],
        "reference": {"play0-outer": {"own_cage_error": 1e-7, "own_band_rms_error": 0.01, "noise_floor": 1e-4}},
        "targets": [{"name": "cage", "value": 1.0, "limit": 2.0, "unit": "1", "met": True},
                    {"name": "floor", "value": None, "limit": 2.0, "unit": "1", "met": None}],
    }  # fmt: skip
    return shown_result("speed_accuracy", StoredResult(path=Path("speed_accuracy.json"), content=content))


@pytest.mark.parametrize(
    ("section", "kind", "others", "command"),
    [
        (stability_section, "stability", (NO_MAP, NO_VERDICTS), "srbval stability"),
        (speed_accuracy_section, "speed_accuracy", (NO_BENCH,), "srbval bench"),
    ],
)
def test_without_a_result_the_section_says_how_to_make_one(
    section: Any, kind: str, others: tuple[ShownResult, ...], command: str
) -> None:
    (only,) = section(shown_result(kind, None), *others, DEFAULT).blocks
    assert isinstance(only, Callout)
    assert f"`{command}`" in only.text


def test_the_map_shows_every_status(stability: ShownResult, tmp_path: Path) -> None:
    blocks = stability_section(stability, NO_MAP, NO_VERDICTS, DEFAULT).all_blocks
    of_main, figure = (b for b in blocks if isinstance(b, Figure))
    assert (of_main.id, figure.id) == ("stability-map", "stability-play0-outer")
    assert "ode1: ok at 1/61440 s 2" in of_main.alt
    files = figure.draw(tmp_path, figure.id)
    text = files.picture.read_text(encoding="utf-8")
    for word in ("ok", "unlike-reference", "too-deep", "predicted limit"):
        assert word in text
    assert "critical velocity 1 mm/s: ok at 1/61440 s 2, 1/30720 s 0, 1/7680 s 0" in figure.alt
    assert len(files.data.read_text(encoding="utf-8").splitlines()) == 1 + 24


def test_what_was_not_caught_is_counted(stability: ShownResult) -> None:
    listing = [
        b for b in stability_section(stability, NO_MAP, NO_VERDICTS, DEFAULT).all_blocks if isinstance(b, Listing)
    ][-1]
    text = " ".join(listing.items)
    assert "8 runs passed their own tests and are unlike" in text
    assert "cage at most 2.0% off" in text
    assert "1 of 2 caught" in text


def test_limits_stand_beside_what_was_seen(stability: ShownResult) -> None:
    (table,) = [
        b for b in stability_section(stability, NO_MAP, NO_VERDICTS, DEFAULT).all_blocks if isinstance(b, Table)
    ]
    first = [c.value for c in table.cells[0]]
    assert first == ["ode1, 1 mm/s", 61440.0, 61440.0, pytest.approx(1e4), pytest.approx(1e8)]


def test_wrong_verdicts_are_counted_and_listed(stability: ShownResult) -> None:
    counts = {
        "runs": 9,
        "says_ok": 5,
        "right_but_unsure": 1,
        "off": 2,
        "failed": 2,
        "falsely_ok": 1,
        "falsely_failed": 0,
    }
    run = {"scene": "rig-outer", "rpm": 859.0, "load": 1.0, "solver": "ode3", "step_s": 1 / 61440, "status": "ok",
           "errors": {"drive power": [0.3, 0.01]}, "falsely_ok": True, "falsely_failed": False}  # fmt: skip
    content = ORIGIN | {
        "counts": counts, "seed": 7, "tolerance": {}, "parts": [{"part": "solver", "value": "ode3"} | counts],
        "runs": [run, run | {"solver": "ode2", "falsely_ok": False}],
    }  # fmt: skip
    verdicts = shown_result("own_verdicts", StoredResult(path=Path("own_verdicts.json"), content=content))
    blocks = stability_section(stability, NO_MAP, verdicts, DEFAULT).all_blocks
    (said,) = [b.text for b in blocks if isinstance(b, Paragraph) and "right about itself" in b.text]
    assert "5 called themselves ok without caution; **1 of these are off**" in said
    (table,) = [b for b in blocks if isinstance(b, Table) and b.id == "own-verdicts"]
    assert [c.value for c in table.cells[0]] == ["solver", "ode3", 9, 5, 1, 1, 2, 0]
    (wrong,) = [b for b in blocks if isinstance(b, Listing)][-1].items
    assert "rig-outer, 859 rpm, load 1, ode3 at 1/61440 s: ok, but drive power +0.3 ± 0.01" in " ".join(wrong.split())
    assert "ode2" not in wrong


def test_orders_stand_where_there_is_one(speed_accuracy: ShownResult) -> None:
    blocks = speed_accuracy_section(speed_accuracy, NO_BENCH, DEFAULT).all_blocks
    (table,) = [b for b in blocks if isinstance(b, Table) and b.id == "observed-orders"]
    assert [[c.value for c in row] for row in table.cells] == [["ode4", None], [DEFAULT.name, 1.5]]
    assert "Rollers rattle in play0-outer" in table.notes[0]


def test_failed_runs_are_in_chart_and_table(speed_accuracy: ShownResult, tmp_path: Path) -> None:
    blocks = speed_accuracy_section(speed_accuracy, NO_BENCH, DEFAULT).all_blocks
    (figure,) = [b for b in blocks if isinstance(b, Figure)]
    assert "ode1 at 1/61440 s failed (load-lost)" in figure.alt
    files = figure.draw(tmp_path, figure.id)
    assert "failed" in files.picture.read_text(encoding="utf-8")
    assert "not-finite" in files.data.read_text(encoding="utf-8")
    tables = {b.id: b for b in blocks if isinstance(b, Table)}
    shown = {(row[0].value, row[-1].value) for row in tables["speed-accuracy-table"].cells}
    assert {
        ("play0-outer, ode1", "load-lost"),
        ("play0-outer, ode1", "not-finite"),
        ("play0-outer, ode4", "ok"),
    } <= shown
    assert ("play0-outer, ode3", "ok") not in shown
    assert [row[-1].value for row in tables["speed-accuracy-targets"].cells] == ["met", "not measured"]


def test_the_rigs_scene_stands_beside_the_papers(stability: ShownResult, speed_accuracy: ShownResult) -> None:
    as_text = json.dumps([stability.content, speed_accuracy.content]).replace("play0-outer", "rig-outer")
    rig_map, rig_bench = (
        replace(of, content=c) for of, c in zip((stability, speed_accuracy), json.loads(as_text), strict=True)
    )
    blocks = (
        *stability_section(stability, rig_map, NO_VERDICTS, DEFAULT).all_blocks,
        *speed_accuracy_section(speed_accuracy, rig_bench, DEFAULT).all_blocks,
    )
    ids = [b.id for b in blocks if isinstance(b, Figure)]
    shown = [f"{kind}-{scene}-outer" for kind in ("stability", "speed-accuracy") for scene in ("play0", "rig")]
    assert ids == ["stability-map", *shown]
    tables = {b.id: b for b in blocks if isinstance(b, Table)}
    assert tables["rig-stability-limits"].cells[0][0].value == "ode1", "oil has no critical velocity of its own"
    scenes = {str(row[0].value).split(", ")[0] for row in tables["speed-accuracy-table"].cells}
    assert scenes == {"play0-outer", "rig-outer"}


def test_both_say_who_measured_when(stability: ShownResult, speed_accuracy: ShownResult) -> None:
    for section in (
        stability_section(stability, NO_MAP, NO_VERDICTS, DEFAULT),
        speed_accuracy_section(speed_accuracy, NO_BENCH, DEFAULT),
    ):
        text = json.dumps([getattr(b, "text", "") for b in section.all_blocks])
        assert "A & <B>" in text
        assert "2026-01-01" in text


def test_the_chains_table_takes_an_older_result_too() -> None:
    old = {"low_hz": 500.0, "high_hz": 1500.0, "one_pass": 6e-6, "papers_chain": 9e-4, "one_pass_less_chain": 9e-4}
    new = old | {"envelope_less_chain": 8e-4, "envelope_rms_less_chain": 1e-4, "lines_less_chain": 2e-4,
                 "fault_line_less_chain": 1e-7, "agree_beyond_s": 0.5}  # fmt: skip
    table = READING_TEXTS.table("reading-chains", [old, new])
    shown = [[cell.text(column) for cell, column in zip(row, table.columns, strict=True)] for row in table.cells]
    assert shown[0] == ["500 to 1500", "6.0e-06", "9.0e-04", "9.0e-04", *5 * ["–"]]
    assert shown[1] == [*shown[0][:4], "8.0e-04", "1.0e-04", "2.0e-04", "1.0e-07", "0.50"]
