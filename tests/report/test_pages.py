"""Pages that studies bring: without a result they say how to make one, with it they are whole, failures included."""

from pathlib import Path
from typing import Any

import pytest

from srbval.report.blocks import Callout, Figure, Paragraph, Table
from srbval.report.pages import StoredResults, joined_data, origin_of, results_of, study_page
from srbval.report.prose import Prose
from srbval.storage.stored_result import StoredResult
from srbval.studies.harness import pages

PAGES = {page.name: page for page in pages()}


@pytest.mark.parametrize("name", [name for name, page in PAGES.items() if page.results])
def test_without_a_result_a_page_says_how_to_make_one(name: str) -> None:
    section = PAGES[name].section(StoredResults())
    remarks = [block for block in section.blocks if isinstance(block, Callout)]
    assert section.blocks == () or any("`srbval " in remark.text for remark in remarks)


@pytest.mark.parametrize("name", PAGES)
def test_with_its_results_a_page_has_tables_and_figures_that_draw(name: str, tmp_path: Path) -> None:
    page = PAGES[name]
    results = results_of([page])
    if set(page.results) - set(results):
        pytest.skip("not every result is stored")
    blocks = page.section(results).blocks
    assert any(isinstance(block, Table | Figure) or getattr(block, "text", "") for block in blocks)
    for figure in (block for block in blocks if isinstance(block, Figure)):
        figure.draw(tmp_path, figure.id)
        assert (tmp_path / f"{figure.id}.svg").stat().st_size > 0
        assert len((tmp_path / f"{figure.id}.csv").read_text(encoding="utf-8").splitlines()) > 1


def test_lists_of_pages_are_joined_and_other_keys_added() -> None:
    assert joined_data({"rows": [1]}, [{"rows": (2,)}, {"more": 3}]) == {"rows": [1, 2], "more": 3}


STORED = {
    "made_utc": "2026-11-26T10:00:00+00:00",
    "machine": {"processor": "A*B", "usable_cores": 2},
    "command": "srbval evidence naming",
    "git_revision": "abc",
}
SETS = [{"name": "Ottawa", "records": 60, "revision": "2", "date": "2023-05-01"}, {"name": "HUST"}]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, "evidence: this program can compute it again"),
        ({"evidence_kind": "recorded", "data_sets": SETS}, "Data sets: Ottawa, 60 records, 2, 2023-05-01; HUST."),
        ({"computed_once": "a prediction"}, "a document of revision abc, never recomputed"),
    ],
)
def test_the_origin_of_a_result_says_kind_date_machine_and_command(more: dict[str, Any], words: str) -> None:
    text = origin_of(StoredResult(path=Path("naming.json"), content=STORED | more)).text
    for part in (words, "2026-11-26T10:00:00+00:00", "A\\*B (2 usable cores)", "`srbval evidence naming`"):
        assert part in text


def test_a_study_page_starts_with_the_origin_or_the_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Prose, "_parts", {"": "# Naming {#naming}", "found": "{n} of 3."})
    page = study_page("made.naming", 10, lambda prose, content: [prose.paragraph("found", n=content["n"])])
    result = StoredResult(path=Path("naming.json"), content=STORED | {"n": 2})
    origin, found = page.section(StoredResults({"naming": result})).blocks
    assert (origin, found) == (origin_of(result), Paragraph("2 of 3."))
    (remark,) = page.section(StoredResults()).blocks
    assert isinstance(remark, Callout)
    assert "`srbval evidence naming`" in remark.text
