"""The HTML page, the PDF and report.json show the same numbers, those of the tree."""

import html
import json
import re
import shutil
import subprocess
from collections.abc import Iterator, Mapping
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest

from srbval.report.blocks import MISSING, Report
from srbval.report.plain import printable

from .made import Made

pytest.importorskip("typst")

MOST_PAGES = {"pdf": 12, "appendix_pdf": 50}
LEAST_NUMBERS = 300  # of a whole report's tables; fewer would mean that most were not looked at
NUMBER = re.compile(r"[+-]?\d[\d,]*(?:\.\d+)?(?:e[+-]?\d+)?")
ROUNDING = 0.5000001  # of the last digit shown: a number stands for what rounds to it, ties both ways
TIMED_COLUMNS = {("runs-table", "Wall time per simulated second")}  # differ from run to run, so not in report.json
WITH_PDFTOTEXT = pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext (poppler) is not installed")


class Tables(HTMLParser):
    """The tables of a page by the id of the block they stand in: rows of cells' texts, notes in a cell left out."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: dict[str, list[list[str]]] = {}
        self._id, self._body, self._in_cell, self._note, self._spans = "", False, False, 0, 0
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = dict(attrs)
        if tag == "div" and known.get("class") == "table":
            self._id = known["id"] or ""
            self.found[self._id] = []
        elif tag == "tbody":
            self._body = True
        elif tag == "tr" and self._body:
            self.found[self._id].append([])
        elif tag in ("td", "th") and self._body:
            self._in_cell = True
            self.found[self._id][-1].append("")
        elif tag == "span" and self._in_cell:
            self._spans += 1
            marked = (known.get("class") or "").split()[:1] in (["note"], ["badge"]) or "aria-hidden" in known
            self._note = self._note or (self._spans if marked else 0)

    def handle_endtag(self, tag: str) -> None:
        if tag == "tbody":
            self._body = False
        elif tag in ("td", "th"):
            self._in_cell = False
        elif tag == "span" and self._in_cell:
            self._note = 0 if self._note == self._spans else self._note
            self._spans -= 1

    def handle_data(self, data: str) -> None:
        if self._in_cell and not self._note:
            self.found[self._id][-1][-1] += data


def stands_for(shown: str, value: float) -> bool:
    """Whether a number as shown is `value` rounded to the digits shown."""
    digits, _, exponent = shown.replace(",", "").partition("e")
    decimals = len(digits.partition(".")[2])
    unit = 10.0 ** (int(exponent or 0) - decimals)
    if decimals == 0 and "." not in digits and not exponent:  # a format of significant digits may leave out zeros
        unit = 10.0 ** (len(digits) - len(digits.rstrip("0")))
    return abs(float(shown.replace(",", "")) - value) <= ROUNDING * unit


def unmatched(text: str, cell: dict[str, Any]) -> list[str]:
    """The numbers of a cell's text that its entry in report.json does not hold."""
    if isinstance(cell["value"], str):
        return [] if text == " ".join(printable(cell["value"]).split()) else [text]
    values = [v for key in ("value", "ci95") if (v := cell.get(key)) is not None and not isinstance(v, bool)]
    return [shown for shown in NUMBER.findall(text) if not any(stands_for(shown, v) for v in values)]


def differences(files: Mapping[str, Path]) -> tuple[int, list[tuple[str, str]]]:
    """How many numbers the tables of both pages show, and table and text of those that report.json does not hold."""
    tables = {table["id"]: table for table in json.loads(files["json"].read_text("utf-8"))["tables"]}
    pages = [Tables(files[kind].read_text("utf-8")).found for kind in ("html", "appendix_html") if kind in files]
    shown = {name: rows for page in pages for name, rows in page.items()}
    assert set(shown) == set(tables)
    assert len(shown) == sum(map(len, pages)), "a table stands in one document"
    count, missing = 0, []
    for name, rows in shown.items():
        columns = tables[name]["columns"]
        assert len(rows) == len(tables[name]["rows"])
        for texts, cells in zip(rows, tables[name]["rows"], strict=True):
            for text, cell, column in zip(texts, cells, columns, strict=True):
                if column["timed"]:
                    assert (name, column["title"]) in TIMED_COLUMNS
                    continue
                plain = " ".join(text.split())
                count += len(NUMBER.findall(plain))
                missing += [(name, number) for number in unmatched(plain, cell)]
    return count, missing


def expected_numbers(report: Report) -> Iterator[str]:
    for table in report.tables():
        for row in table.rows:
            for cell, column in zip(row, table.columns, strict=True):
                if not isinstance(cell.value, str) and cell.text(column) != MISSING:
                    yield cell.text(column)


def words(text: str) -> str:
    return " ".join(text.replace("\u200b", "").split())


def page_words(page: Path) -> str:
    return words(html.unescape(re.sub(r"<[^>]+>", " ", page.read_text("utf-8"))))


def paper_words(pdf: Path, *options: str) -> str:
    run = subprocess.run(["pdftotext", *options, pdf, "-"], capture_output=True, check=True)
    return words(run.stdout.decode("utf-8"))


@pytest.mark.parametrize("name", ["with_rig", "hostile"])
def test_every_number_of_every_table_is_in_report_json(name: str, request: pytest.FixtureRequest) -> None:
    count, missing = differences(request.getfixturevalue(name).files)
    assert count > LEAST_NUMBERS
    assert missing == []


@WITH_PDFTOTEXT
def test_each_number_of_a_whole_report_is_in_both(with_rig: Made) -> None:
    files = with_rig.files
    page = page_words(files["html"]) + page_words(files["appendix_html"])
    paper = paper_words(files["pdf"]) + paper_words(files["appendix_pdf"])
    numbers = list(expected_numbers(with_rig.report))
    assert len(numbers) > LEAST_NUMBERS
    assert [n for n in numbers if n not in page] == []
    assert [n for n in numbers if n not in paper] == []


@WITH_PDFTOTEXT
@pytest.mark.parametrize(("kind", "most"), MOST_PAGES.items())
def test_a_whole_report_is_no_book(with_rig: Made, kind: str, most: int) -> None:
    run = subprocess.run(["pdftotext", with_rig.files[kind], "-"], capture_output=True, check=True)
    assert run.stdout.count(b"\f") <= most
