"""The main document is short and in order; what it leaves out stands in the appendix, which it names."""

from __future__ import annotations

import dataclasses
import json
import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from srbval.report import Figure, Paragraph, Report, Section, write_report
from srbval.report.reports import MadeReport

from .test_report_pdf import unpacked
from .whole import PANELS

MOST_WORDS = 3_500
SECTIONS = (
    "verdict", "records-section", "table-6", "speed-or-slip", "figures", "waterfall", "rig-scene", "speed-accuracy",
    "stability", "ladder", "limits", "glossary", "provenance",
)  # fmt: skip
NOT_BODY = {"nav", "thead", "tbody", "script", "style", "head"}  # tables count by their captions and notes


class Body(HTMLParser):
    """Words of a page, without its contents and the cells of its tables; the ids of its sections and figures."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.words, self.sections, self.figures, self._outside = 0, [], [], 0
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._outside += tag in NOT_BODY
        if tag in ("section", "figure"):
            (self.sections if tag == "section" else self.figures).append(dict(attrs)["id"])

    def handle_endtag(self, tag: str) -> None:
        self._outside -= tag in NOT_BODY

    def handle_data(self, data: str) -> None:
        if not self._outside:
            self.words += len(re.findall(r"\w[\w.,'’-]*", data))


def body(made: MadeReport, kind: str = "html") -> Body:
    return Body(made.files[kind].read_text(encoding="utf-8"))


def test_it_is_short(with_rig: tuple[MadeReport, Path]) -> None:
    assert body(with_rig[0]).words <= MOST_WORDS


def test_it_answers_in_this_order(with_rig: tuple[MadeReport, Path]) -> None:
    found = [name for name in body(with_rig[0]).sections if name in SECTIONS]
    assert tuple(found) == SECTIONS


def test_the_papers_figures_stand_in_it_and_one_chart_of_each_study(with_rig: tuple[MadeReport, Path]) -> None:
    found = body(with_rig[0]).figures
    assert set(found) >= PANELS
    charts = [name for name in found if name.startswith(("speed-accuracy", "stability", "ladder"))]
    assert charts == ["speed-accuracy-interference-outer", "stability-map", "ladder-figure"]


def test_the_appendix_has_the_rest_and_no_figure_stands_twice(with_rig: tuple[MadeReport, Path]) -> None:
    main, appendix = (body(with_rig[0], kind) for kind in ("html", "appendix_html"))
    assert not set(main.figures) & set(appendix.figures)
    pictures = {path.stem for path in (with_rig[1] / "figures").glob("*.svg")}
    assert pictures <= {*main.figures, *appendix.figures}
    assert "verdict" not in appendix.sections


@pytest.fixture
def both(report: Report, panels: tuple[Figure, ...]) -> Report:
    """The small report with an appendix."""
    figure = dataclasses.replace(panels[0], id="further")
    section = Section(id="more", title="More", appendix=(Paragraph("Further words."), figure))
    return dataclasses.replace(report, sections=(*report.sections, section))


def test_without_the_appendix_the_page_says_how_to_make_it(both: Report, tmp_path: Path) -> None:
    files = write_report(both, tmp_path, ("html", "json"))
    assert set(files) == {"html", "json"}
    page = files["html"].read_text(encoding="utf-8")
    assert "--appendix" in page
    assert "appendix.html" not in page
    assert "Further words." not in page


def with_figures(file: Path) -> set[str]:
    """The figures of ``report.json``, each with its picture and its data."""
    figures = json.loads(file.read_text(encoding="utf-8"))["figures"]
    assert all((file.parent / figure[key]).is_file() for figure in figures for key in ("file", "data"))
    return {figure["id"] for figure in figures}


def test_with_the_appendix_each_names_the_other(both: Report, tmp_path: Path) -> None:
    without = write_report(both, tmp_path / "without", ("json",))["json"]
    files = write_report(both, tmp_path / "with", ("html", "pdf", "json"), appendix=True)
    assert with_figures(files["json"]) == {"fig11b", "fig12a", "further"}
    assert with_figures(without) == {"fig11b", "fig12a"}
    assert not (tmp_path / "without" / "figures" / "further.svg").exists()
    assert 'href="appendix.html"' in files["html"].read_text(encoding="utf-8")
    appendix = files["appendix_html"].read_text(encoding="utf-8")
    assert 'href="report.html"' in appendix
    assert "Further words." in appendix
    assert "Numbers" not in appendix
    assert b"appendix.pdf" in unpacked(files["pdf"].read_bytes())
    assert b"report.pdf" in unpacked(files["appendix_pdf"].read_bytes())


def test_a_report_without_an_appendix_speaks_of_none(report: Report, tmp_path: Path) -> None:
    assert set(write_report(report, tmp_path, ("html",), appendix=True)) == {"html"}
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "appendix" not in re.sub(r"<style>.*?</style>", "", page, flags=re.DOTALL)
