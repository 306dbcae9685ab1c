"""The HTML page and the PDF show the same numbers, those of the tree."""

import html
import re
import shutil
import subprocess

import pytest

from srbval.report import write_report
from srbval.report.table import MISSING

pytest.importorskip("typst")

LARGEST_PAGES = 50


def expected_numbers(report):
    for table in report.tables():
        for row in table.cells:
            for cell, column in zip(row, table.columns, strict=True):
                if not isinstance(cell.value, str) and cell.text(column) != MISSING:
                    yield cell.text(column)


def words(text):
    return " ".join(text.replace("\u200b", "").split())


@pytest.fixture(scope="module")
def written(report, tmp_path_factory):
    return write_report(report, tmp_path_factory.mktemp("parity"))


def test_each_number_of_the_tables_is_on_the_page(report, written):
    page = words(html.unescape(re.sub(r"<[^>]+>", " ", written["html"].read_text("utf-8"))))
    numbers = list(expected_numbers(report))
    assert len(numbers) >= 7
    for number in numbers:
        assert number in page


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext (poppler) is not installed")
def test_each_number_of_a_whole_report_is_in_both(hostile_report):
    report, files = hostile_report
    page = words(html.unescape(re.sub(r"<[^>]+>", " ", files["html"].read_text("utf-8"))))
    run = subprocess.run(["pdftotext", files["pdf"], "-"], capture_output=True, check=True)
    paper = words(run.stdout.decode("utf-8"))
    numbers = list(expected_numbers(report))
    assert len(numbers) > 300
    assert [n for n in numbers if n not in page] == []
    assert [n for n in numbers if n not in paper] == []


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext (poppler) is not installed")
def test_each_number_of_the_tables_is_in_the_pdf(report, written):
    run = subprocess.run(["pdftotext", "-layout", written["pdf"], "-"], capture_output=True, check=True)
    text = words(run.stdout.decode("utf-8"))
    for number in expected_numbers(report):
        assert number in text
    assert '<script>alert(1)</script> "q" \'s\' #panic("x") $x$ *a* _b_ `c` @ref ../../etc' in text


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="pdftotext (poppler) is not installed")
def test_a_whole_report_is_no_book(alone):
    run = subprocess.run(["pdftotext", alone[0].files["pdf"], "-"], capture_output=True, check=True)
    assert run.stdout.count(b"\f") < LARGEST_PAGES
