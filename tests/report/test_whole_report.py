"""Main report with short runs: files, sections and numbers, the same twice and in every form; problems of its data."""

import dataclasses
import html
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

from srbval import DataError, Findings
from srbval.recordings.manifest import FileStatus
from srbval.report.blocks import MISSING, Callout, Listing, cell_text
from srbval.report.findings.findings import list_problems, require_states
from srbval.report.prose import literal
from srbval.report.renderers import mask_controls
from srbval.report.sections.assemble import MAX_LISTED, records_blocks
from srbval.storage.json_files import to_json
from srbval.studies.harness import pages
from tests.readme_table import in_readme, readme_table

from .conftest import FILES, PANELS, Made

TALLEST = 1.35  # height over width: a picture as wide as the page leaves room for its caption above the foot
LARGEST_HTML, LARGEST_PDF = 6_000_000, 8_000_000
HOSTILE = "<b>a</b> **b** `c` {x}"
FROM_KINEMATIC_PCT = 0.35  # Coulomb friction on three circles: 0.27 % (outer, play 0, converged); the paper's 0.22 %
FROM_CAGE = 5e-4  # relative, of a run of one second: the line read from the spectrum is that of the cage
SECTIONS = ("verdict", "table-6", "figures", "near", "rig-scene", "speed-accuracy", "stability", "ladder", "limits")
ROW_KEYS = (
    "defect kinematic_hz paper_model_hz paper_rig_hz model_hz model_ci95_hz model_deviation_pct rig_hz"
    " rig_ci95_hz rig_source comparison_error_pct validation_uncertainty_pct verdict"
)


def ids(page: str, tag: str) -> list[str]:
    return re.findall(rf'<{tag} [^>]*?\bid="([^"]*)"', page)


def test_the_sections_are_in_order_and_every_panel_is_there(with_rig):
    page = with_rig.text("html")
    assert tuple(ids(page, "section")) == SECTIONS
    figures = set(ids(page, "figure"))
    assert figures >= PANELS | {"small-11c", "small-12a", "small-13a", "small-14c"}
    assert {path.stem for path in (with_rig.folder / "figures").glob("*.svg")} == figures


def test_everything_is_written_and_nothing_elsewhere(with_rig):
    assert {p.name for p in with_rig.folder.iterdir()} == FILES
    assert [p.name for p in with_rig.folder.parent.iterdir()] == ["report"]
    names = [p.name for p in (with_rig.folder / "figures").iterdir()]
    assert all(re.fullmatch(r"[a-z0-9-]+\.(svg|csv)", name) for name in names)
    for picture in (with_rig.folder / "figures").glob("*.svg"):
        size = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', picture.read_text(encoding="utf-8"))
        assert size is not None, picture
        assert float(size[2]) <= TALLEST * float(size[1]), picture
    for kind, path in with_rig.files.items():
        assert path.stat().st_size < (LARGEST_PDF if "pdf" in kind else LARGEST_HTML) or kind == "json", kind


def test_json_is_strict_and_has_the_keys_of_the_interface(with_rig):
    found = with_rig.document()
    keys = "table6 closure figures speed_accuracy stability ladder recordings provenance headline schema_version status"
    not_stored = {page.name for page in pages() if page.name not in with_rig.findings.results}
    assert set(keys.split()) - set(found) <= not_stored
    assert all(set(row) >= set(ROW_KEYS.split()) for row in found["table6"])
    assert all({"id", "caption", "alt", "file", "data"} <= set(figure) for figure in found["figures"])


def test_without_a_record_of_each_state_there_is_no_report():
    with pytest.raises(DataError, match=r"healthy, .*reinstall it(.|\n)*a\.mat: truncated"):
        require_states({}, [{"pair": 1, "reason": "a.mat: truncated"}])


def test_with_the_rig_the_rows_are_measured_and_its_sum_closes(with_rig):
    found = with_rig.document()
    measured = [row for row in found["table6"] if row["rig_source"] == "measured"]
    assert [row["defect"] for row in measured] == ["outer", "inner"]
    for row in measured:
        assert row["verdict"] in ("resolved", "agrees", "undecided", "differs", "not resolved")
        assert row["validation_uncertainty_pct"] > 0
        assert abs(row["comparison_error_pct"]) < 0.5
        assert row["shaft_rpm"] == row["rig_shaft_rpm"]
    assert not any(figure["badge"] == "stand-in" for figure in found["figures"])
    assert len(found["recordings"]) == 3
    (rule,) = [s for s in found["closure"] if s["origin"] == "measured"]
    assert rule["total"] == pytest.approx(19, abs=0.01)
    assert rule["closed"] is True


def test_lines_of_the_model_are_those_of_its_cage(with_rig):
    """In Table 6 they are near those of kinematics, and close on the number of rollers once their slip is taken off."""
    found = with_rig.document()
    for row in found["table6"]:
        assert abs(row["model_deviation_pct"]) < FROM_KINEMATIC_PCT
        assert row["model_hz"] == pytest.approx(row["model_cage_hz"], rel=FROM_CAGE)
        assert row["rig_source"] == "measured" or row["verdict"] == "insufficient data", "the paper states none"
    (ours,) = [s for s in found["closure"] if s["origin"] == "simulated"]
    assert (ours["closed"], abs(ours["slip_difference"]) < 0.01) == (True, True)


@pytest.mark.recordings
def test_the_table_in_the_readme_is_that_of_a_report(with_rig):
    report = with_rig.document()
    assert in_readme() == readme_table(report)
    next(table for table in report["tables"] if table["id"] == "table-6-sources")["rows"][-1]["outer"] += 0.01
    assert in_readme() != readme_table(report)


def problems(findings: Findings) -> tuple[list[str], list[str]]:
    """Titles of the boxed remarks on the data, and the records that they list."""
    blocks = list(records_blocks(findings))
    titles = [b.title for b in blocks if isinstance(b, Callout)]
    return titles, [item for b in blocks if isinstance(b, Listing) for item in b.items]


def changed(findings: Findings, **data: Any) -> Findings:
    return dataclasses.replace(findings, data={**findings.data, **data})


def test_problems_of_the_data_are_named_and_counted(with_rig):
    assert with_rig.document()["problems"] == []
    assert problems(with_rig.findings) == ([], [])
    gone = [SimpleNamespace(file=f"set/{n}.mat", status=FileStatus.MISSING, reason="not there") for n in range(2)]
    register = SimpleNamespace(problems=gone)
    pair = {"measured": ["set/a.mat"], "measured_facts": {"cautions": ("clipped: 3 of 9", "held: 5")}}
    rows = list_problems(register, [pair, pair])
    titles, items = problems(changed(with_rig.findings, problems=rows))
    assert titles == ["Recordings with problems: 3"]
    assert items[0] == "**0.mat**: not used, missing; not there"
    assert items[2:] == ["**a.mat**: clipped: 3 of 9", "**a.mat**: held: 5"]
    many = [{"file": HOSTILE, "problem": HOSTILE}] * (MAX_LISTED + 3)
    _, items = problems(changed(with_rig.findings, problems=many))
    assert (items[0], len(items)) == (f"**{literal(HOSTILE)}**: {literal(HOSTILE)}", MAX_LISTED + 1)
    assert items[-1].startswith("3 more")


PAGES = range(6, 9)
MOST_WORDS = 2200  # of letters, on the whole page
LEAST_NUMBERS = 80  # of its tables; fewer would mean that most were not looked at


def words(text: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]*>", "", text)).replace("\u200b", "").split())


def shown_tables(page: Path) -> dict[str, list[list[str]]]:
    """Texts of a page's table cells, row by row, by the id of the table's block."""
    found = {}
    tables = r'<div class="table" id="(.*?)".*?<tbody>(.*?)</tbody>'
    for name, body in re.findall(tables, page.read_text("utf-8"), re.DOTALL):
        rows = re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)
        found[name] = [[words(cell) for cell in re.findall(r"<t[hd].*?>(.*?)</t[hd]>", row, re.DOTALL)] for row in rows]
    return found


def cells(made: Made) -> Iterator[tuple[str, Any, str, str]]:
    """Every cell of every table: its key, value and text, its text on the page; the same row in report.json."""
    of_json = {table["id"]: table["rows"] for table in made.document()["tables"]}
    shown = shown_tables(made.files["html"])
    assert set(shown) == set(of_json) == {table.id for table in made.report.tables()}
    for table in made.report.tables():
        for row, texts, entry in zip(table.rows, shown[table.id], of_json[table.id], strict=True):
            assert entry == to_json(row), table.id
            for (key, column), text in zip(table.columns.items(), texts, strict=True):
                yield key, row[key], cell_text(row[key], row.get(f"{key}_ci95"), column.format), text


def test_the_page_is_short(with_rig):
    body = re.sub(r"<script.*?</script>", "", with_rig.text("html").partition("<body>")[2], flags=re.DOTALL)
    shown = words(re.sub(r"(<[^>]*>)", r" \1 ", body)).split()
    assert len([word for word in shown if re.search("[A-Za-z]{2}", word)]) <= MOST_WORDS


def test_page_and_json_hold_each_cell_at_its_place(with_rig):
    numbers = 0
    for key, value, own, text in cells(with_rig):
        assert words(html.escape(mask_controls(own))) in text, key
        numbers += not isinstance(value, str) and own != MISSING
    assert numbers > LEAST_NUMBERS


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext (poppler) is not installed")
def test_the_paper_has_each_number_and_is_no_book(with_rig):
    run = subprocess.run(["pdftotext", with_rig.files["pdf"], "-"], capture_output=True, check=True)
    assert run.stdout.count(b"\f") in PAGES
    paper = words(run.stdout.decode("utf-8"))
    for _, value, own, _ in cells(with_rig):
        assert isinstance(value, str) or own == MISSING or own in paper


def test_a_rig_s_value_has_one_interval(with_rig):
    values = [row["rig"] for row in next(t for t in with_rig.report.tables() if t.id == "near-table").rows]
    assert {str(value).count("±") for value in values if value} == {1}


def test_each_table_is_a_csv_file(with_rig):
    for table in with_rig.report.tables():
        assert len(pd.read_csv(with_rig.folder / "figures" / f"{table.id}.csv")) == len(table.rows)
