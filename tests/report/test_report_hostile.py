"""Text that a recording brings is shown as text, breaks no page, and writes nowhere else."""

from __future__ import annotations

import json
import re
from html import unescape
from pathlib import Path

from srbval.report.reports import MadeReport

from .whole import FILE_NAME, FILES, HOSTILE, TEXT

SHOWN = TEXT.replace("\x00", "\ufffd").replace("\u202e", "\ufffd")
LARGEST_HTML, LARGEST_PDF = 6_000_000, 8_000_000


def words(page: str) -> str:
    return unescape(re.sub(r"<[^>]*>", "", re.sub(r"<(script|style)>.*?</\1>", "", page, flags=re.DOTALL)))


def test_a_hostile_file_name_is_in_its_table(alone: tuple[MadeReport, Path]) -> None:
    page = alone[0].files["appendix_html"].read_text("utf-8")
    assert FILE_NAME in words(page)
    assert page.count("<script>") == 1


def test_hostile_names_are_shown_as_they_are(hostile: dict[str, Path]) -> None:
    pages = [hostile[kind].read_text("utf-8") for kind in ("html", "appendix_html")]
    assert [page.count("<script>") for page in pages] == [1, 1]
    assert sum(words(page).count(SHOWN) for page in pages) >= 6
    assert all("A" * 10_000 in page for page in pages)


def test_hostile_names_survive_in_the_data(hostile: dict[str, Path]) -> None:
    found = json.loads(hostile["json"].read_bytes())
    assert found["other_rigs"][-1]["file"] == HOSTILE


def test_nothing_is_written_elsewhere(hostile: dict[str, Path]) -> None:
    folder = hostile["html"].parent
    assert {p.name for p in folder.iterdir()} == FILES
    assert {p.name for p in folder.parent.iterdir()} == {"report"}
    assert all(re.fullmatch(r"[a-z0-9-]+\.(svg|png|csv)", p.name) for p in (folder / "figures").iterdir())


def test_both_files_are_small_enough(alone: tuple[MadeReport, Path], hostile: dict[str, Path]) -> None:
    for files in (alone[0].files, hostile):
        for kind, path in files.items():
            assert path.stat().st_size < (LARGEST_PDF if "pdf" in kind else LARGEST_HTML) or kind == "json", kind
