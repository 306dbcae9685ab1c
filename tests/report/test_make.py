"""The main job, short: what it writes, what it claims, and that a stand-in never counts as measured."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from srbval.report.reports import MadeReport

from .whole import FILES, PANELS

TALLEST = 1.35  # height over width: a picture as wide as the page leaves room for its caption above the foot


def document(made: tuple[MadeReport, Path]) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(made[0].files["json"].read_text(encoding="utf-8"))
    return found


def test_everything_is_written(alone: tuple[MadeReport, Path]) -> None:
    _, folder = alone
    assert {p.name for p in folder.iterdir()} == FILES
    assert {f"{panel}.svg" for panel in PANELS} <= {p.name for p in (folder / "figures").iterdir()}


def test_no_picture_is_too_tall_for_a_page_with_its_caption(alone: tuple[MadeReport, Path]) -> None:
    sizes = {
        picture.name: re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', picture.read_text(encoding="utf-8"))
        for picture in (alone[1] / "figures").glob("*.svg")
    }
    assert len(sizes) > len(PANELS)
    assert [name for name, size in sizes.items() if size is None or float(size[2]) > TALLEST * float(size[1])] == []


def test_json_has_the_keys_of_the_interface(alone: tuple[MadeReport, Path]) -> None:
    found = document(alone)
    keys = "table6 closure figures speed_accuracy stability ladder recordings provenance headline schema_version status"
    assert set(keys.split()) <= set(found)
    row_keys = (
        "defect kinematic_hz paper_model_hz paper_rig_hz model_hz model_ci95_hz model_deviation_pct rig_hz "
        "rig_ci95_hz rig_source comparison_error_pct validation_uncertainty_pct verdict"
    )
    assert all(set(row_keys.split()) <= set(row) for row in found["table6"])
    assert all({"id", "caption", "alt", "file", "data"} <= set(figure) for figure in found["figures"])


def test_model_lines_agree_with_the_cage_within_their_interval(alone: tuple[MadeReport, Path]) -> None:
    for row in document(alone)["table6"]:
        assert abs(row["model_deviation_pct"]) < 0.35  # Coulomb friction on three circles; 0.30 % converged, play 0
        assert row["model_hz"] == pytest.approx(row["model_cage_hz"], abs=row["model_ci95_hz"])


def test_a_stand_in_never_counts(alone: tuple[MadeReport, Path]) -> None:
    found = document(alone)
    assert {row["rig_source"] for row in found["table6"]} == {"published"}
    assert {row["verdict"] for row in found["table6"]} == {"insufficient data"}
    synthetic = {f["id"] for f in found["figures"] if f["synthetic"]}
    assert synthetic == {
        "fig11b", "fig11d", "fig11f", "fig12b", "fig13b", "fig14b", "fig14d", "fig14f", "kurtogram-b", "kurtogram-d",
            "band-rig",
    }  # fmt: skip
    for name in synthetic:
        assert "SYNTHETIC STAND-IN" in (alone[1] / "figures" / f"{name}.svg").read_text(encoding="utf-8")
    assert found["recordings"] == []
    page = alone[0].files["html"].read_text(encoding="utf-8")
    assert "srbval data fetch torino-excerpts" in page
    assert not any(s["origin"] == "measured" for s in found["closure"])


def test_each_side_is_read_in_both_bands_and_the_figure_says_what_drew_it(with_rig: tuple[MadeReport, Path]) -> None:
    crossed = document(with_rig)["crossed_bands"]
    assert len(crossed) == 8
    assert all(row["detected"] for row in crossed if row["own"])
    page = with_rig[0].files["appendix_html"].read_text(encoding="utf-8")
    assert "closed-form Morlet" in page
    assert "pywt.cwt as it comes" in page


def test_with_the_rig_the_rows_are_measured(with_rig: tuple[MadeReport, Path]) -> None:
    found = document(with_rig)
    measured = [row for row in found["table6"] if row["rig_source"] == "measured"]
    assert [row["defect"] for row in measured] == ["outer", "inner"]
    for row in measured:
        assert row["verdict"] in ("resolved", "agrees", "undecided")
        assert row["validation_uncertainty_pct"] > 0
        assert abs(row["comparison_error_pct"]) < 0.5
        assert row["shaft_rpm"] == row["rig_shaft_rpm"]
    assert not any(figure["synthetic"] for figure in found["figures"])
    assert len(found["recordings"]) == 3


def test_with_the_rig_its_sum_closes(with_rig: tuple[MadeReport, Path]) -> None:
    (rule,) = [s for s in document(with_rig)["closure"] if s["origin"] == "measured"]
    assert rule["total"] == pytest.approx(19, abs=0.01)
    assert rule["closed"] is True
