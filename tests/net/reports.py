"""Item `report`: the main report and reports on recordings; their data, section headings and visible text."""

import json
import tomllib
from html.parser import HTMLParser
from typing import Any

from tests.net.child import Checkout, recordings_folder
from tests.net.recorded import CASES

HIDDEN = {"style", "script", "svg", "title"}
BLOCKS = {"p", "li", "td", "th", "tr", "div", "section", "figcaption", "dt", "dd", "summary", "pre", "nav", "caption"}
CELLS = {"td", "th"}
TIMED = "s/s"  # unit of columns of measured times, whose cells differ from run to run
HEADINGS = {"h1", "h2", "h3", "h4", "h5"}


def record(checkout: Checkout) -> dict[str, Any]:
    """The main report with its appendix, one run at a time, and those that ``recordings.toml`` names."""
    folder, found = recordings_folder(), {}
    found["main"] = _report(checkout, "main", ["--jobs", "1"])
    for data_set, known in tomllib.loads(CASES.read_text(encoding="utf-8")).items():
        for number, case in enumerate(known.get("reports", [])):
            words = [str(folder / data_set / file) for file in case["files"]] + known.get("options", [])
            if "healthy" in case:
                words += ["--healthy", str(folder / data_set / case["healthy"])]
            if (folder / data_set).is_dir():
                name = f"{data_set}-{number}"
                found[name] = _report(checkout, name, words)
    return found


def _report(checkout: Checkout, name: str, words: list[str]) -> dict[str, Any]:
    ended = checkout.run("report", "--json", "--no-pdf", "--appendix", "-o", name, *words)
    made = checkout.scratch / name
    found = {"command": ended, "files": sorted(p.relative_to(made).as_posix() for p in made.rglob("*") if p.is_file())}
    if (made / "report.json").exists():
        found["json"] = checkout.comparable(json.loads((made / "report.json").read_text(encoding="utf-8")))
    for page in sorted(made.glob("*.html")):
        seen = _Visible()
        seen.feed(page.read_text(encoding="utf-8"))
        found[page.name] = {"headings": checkout.comparable(seen.headings), "text": checkout.comparable(seen.lines)}
    return found


class _Visible(HTMLParser):
    """Visible text of a page, one line for each block, and its headings."""

    def __init__(self) -> None:
        super().__init__()
        self.lines: list[str] = []
        self.headings: list[str] = []
        self._text, self._hidden = "", 0
        self._column, self._timed = 0, set[int]()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:  # noqa: ARG002
        self._hidden += tag in HIDDEN
        self._timed = set() if tag == "table" else self._timed
        self._column = 0 if tag == "tr" else self._column + (tag in CELLS)
        if tag in BLOCKS | HEADINGS:
            self._end_line()

    def handle_endtag(self, tag: str) -> None:
        self._hidden -= tag in HIDDEN
        if tag in HEADINGS:
            self.headings.append(f"{tag}: {' '.join(self._text.split())}")
        if tag in CELLS and self._column in self._timed:
            self._text = "<timed>"
        elif tag == "th" and self._text.strip().endswith(TIMED):
            self._timed.add(self._column)
        if tag in BLOCKS | HEADINGS:
            self._end_line()

    def handle_data(self, data: str) -> None:
        self._text += "" if self._hidden else data

    def _end_line(self) -> None:
        line = " ".join(self._text.split())
        self.lines += [line] if line else []
        self._text = ""
