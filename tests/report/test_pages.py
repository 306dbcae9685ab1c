"""Pages that studies bring: without a result they say how to make one, with it they are whole, failures included."""

from pathlib import Path
from typing import Any

import pytest

from srbval.report.blocks import Callout, Figure, Section, Table
from srbval.report.pages import StoredResults, in_order, joined_data, results_of
from srbval.report.write import report_data
from srbval.studies.harness import pages

PAGES = {page.name: page for page in pages()}


@pytest.mark.parametrize("name", [name for name, page in PAGES.items() if page.results])
def test_without_a_result_a_page_says_how_to_make_one(name: str) -> None:
    section = PAGES[name].section(StoredResults())
    remarks = [block for block in section.all_blocks if isinstance(block, Callout)]
    assert section.all_blocks == () or any("`srbval " in remark.text for remark in remarks)


@pytest.mark.parametrize("name", PAGES)
def test_with_its_results_a_page_has_tables_and_figures_that_draw(name: str, tmp_path: Path) -> None:
    page = PAGES[name]
    results = results_of([page])
    if set(page.results) - set(results):
        pytest.skip("not every result is stored")
    blocks = page.section(results).all_blocks
    assert any(isinstance(block, Table | Figure) or getattr(block, "text", "") for block in blocks)
    for figure in (block for block in blocks if isinstance(block, Figure)):
        files = figure.draw(tmp_path, figure.id)
        assert files.picture.stat().st_size > 0
        assert len(files.data.read_text(encoding="utf-8").splitlines()) > 1


def test_sections_of_one_id_become_one_in_the_order_of_their_places() -> None:
    sections = [Section(id=i, title=t) for i, t in (("a", "A"), ("b", "B"), ("a", "A too"))]
    ordered = in_order(zip((1.0, 3.0, 2.0), sections, strict=True))
    assert [(one.id, one.title) for one in ordered] == [("a", "A"), ("b", "B")]


def test_lists_of_pages_are_joined_and_other_keys_added() -> None:
    assert joined_data({"rows": [1]}, [{"rows": (2,)}, {"more": 3}]) == {"rows": [1, 2], "more": 3}


def test_figures_are_listed_from_the_tree(report: Any) -> None:
    data = report_data(report)
    assert [(f["id"], f["file"], f["data"], f["synthetic"]) for f in data["figures"]] == [
        ("fig11b", "figures/fig11b.svg", "figures/fig11b.csv", True),
        ("fig12a", "figures/fig12a.svg", "figures/fig12a.csv", False),
    ]
