"""The page, the PDF, report.json and the CSV files hold every table of the tree: the same cells."""

import html
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pandas as pd
import pytest

from srbval.report.blocks import MISSING, Cell, Column
from srbval.report.plain import printable
from srbval.storage.json_files import to_json

from .made import Made

pytest.importorskip("typst")

MOST_PAGES = 24
LEAST_NUMBERS = 200  # of a whole report's tables; fewer would mean that most were not looked at


def words(text: str) -> str:
    return " ".join(html.unescape(re.sub(r"<[^>]*>", "", text)).replace("\u200b", "").split())


def shown_tables(page: Path) -> dict[str, list[list[str]]]:
    """Texts of the cells of a page's tables, row by row, by the id of the block that a table stands in."""
    found = {}
    for name, body in re.findall(
        r'<div class="table" id="(.*?)".*?<tbody>(.*?)</tbody>', page.read_text("utf-8"), re.S
    ):
        rows = re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)
        found[name] = [[words(cell) for cell in re.findall(r"<t[hd].*?>(.*?)</t[hd]>", row, re.DOTALL)] for row in rows]
    return found


def cells(made: Made) -> Iterator[tuple[str, Column, Cell, str, dict[str, object]]]:
    """Each cell of each table: the table's name, the column, the cell, its text in a page, its entry in report.json."""
    of_json = {table["id"]: table["rows"] for table in made.document()["tables"]}
    shown = shown_tables(made.files["html"])
    assert set(shown) == set(of_json) == {table.id for table in made.report.tables()}
    for table in made.report.tables():
        for row, texts, entries in zip(table.rows, shown[table.id], of_json[table.id], strict=True):
            for one in zip(table.columns, row, texts, entries, strict=True):
                yield table.id, *one


def test_page_and_json_hold_each_cell_at_its_place(with_rig):
    numbers = 0
    for table, column, cell, text, entry in cells(with_rig):
        assert words(html.escape(printable(cell.text(column)))) in text, (table, column.title)
        assert entry["value"] == to_json(cell.value), (table, column.title)
        assert entry.get("ci95") == to_json(cell.ci95)
        numbers += not isinstance(cell.value, str) and cell.text(column) != MISSING
    assert numbers > LEAST_NUMBERS


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext (poppler) is not installed")
def test_the_paper_has_each_number_and_is_no_book(with_rig):
    run = subprocess.run(["pdftotext", with_rig.files["pdf"], "-"], capture_output=True, check=True)
    assert run.stdout.count(b"\f") <= MOST_PAGES
    paper = words(run.stdout.decode("utf-8"))
    for _, column, cell, _, _ in cells(with_rig):
        assert isinstance(cell.value, str) or cell.text(column) == MISSING or cell.text(column) in paper


def test_each_table_and_the_rows_behind_them_are_csv_files(with_rig):
    found, folder = with_rig.document(), with_rig.folder / "figures"
    for table in with_rig.report.tables():
        assert len(pd.read_csv(folder / f"{table.id}.csv")) == len(table.rows)
    read = pd.read_csv(folder / "rows-line-deviations.csv")
    rows = found["line_deviations"]
    assert read["slip_pct"].tolist() == pytest.approx([row["slip_pct"] for row in rows])
    assert read["record"].tolist() == [row["record"] for row in rows]
    assert {path.stem for path in folder.glob("rows-*.csv")} == set(with_rig.report.rows)
