"""Prose in Markdown, and the pages that studies bring: with and without a result, and without a study."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import srbval
from srbval.report.blocks import Badge, Callout, Figure, Listing, Paragraph, Table, Tone
from srbval.report.pages import StoredResults, joined_data, origin_of, results_of, study_page
from srbval.report.plain import spans
from srbval.report.prose import Prose
from srbval.storage.stored_result import StoredResult
from srbval.studies.harness import pages, study_names

SOURCE = """# Cage speed of {bearing} {#cage-speed}

## intro
The mean of {count} runs
is {error:+.2f} %.

## points
- **First**: {file!l}
- Second
  over two lines.

## chart.caption
Ratio by speed.
## chart.alt
A line.
## chart.label
Figure {number}

## limits.caption
Limits.
## limits.notes
- In seconds.

## careful.title
Careful
## careful
Not all is known.
"""


@pytest.fixture
def prose(tmp_path, monkeypatch):
    """The source above as the file of a package."""
    package = tmp_path / "made_prose"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "texts.md").write_text(SOURCE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "made_prose", raising=False)
    return Prose("made_prose")


def test_texts_take_values_and_keep_foreign_text_literal(prose):
    assert prose.paragraph("intro", count=3, error=0.1234) == Paragraph("The mean of 3 runs is +0.12 %.")
    listing = prose.listing("points", file="a**b**")
    assert isinstance(listing, Listing)
    assert listing.items[1] == "Second over two lines."
    assert spans(listing.items[0]) == (("strong", "First"), ("text", ": a**b**"))
    assert prose.text("intro", count=3, error=-0.001) == "The mean of 3 runs is 0.00 %."


def test_section_callout_figure_and_table(prose):
    section = prose.section(prose.paragraph("careful"), bearing="SKF")
    assert (section.id, section.title, len(section.blocks)) == ("cage-speed", "Cage speed of SKF", 1)
    assert prose.callout("careful", tone=Tone.WARNING) == Callout(Tone.WARNING, "Not all is known.", "Careful")
    figure = prose.figure("chart", lambda *_: None, id="chart-2", badge="measured", number=2)
    assert isinstance(figure, Figure)
    assert (figure.id, figure.label, figure.caption, figure.alt) == (
        "chart-2",
        "Figure 2",
        "Ratio by speed.",
        "A line.",
    )
    assert figure.badge is Badge.MEASURED
    assert prose.grid("careful", [figure]).caption == "Not all is known."
    table = prose.table("limits", [{"a": 1}], {"a": "A"})
    assert (table.id, table.caption, table.label, table.notes) == ("limits", "Limits.", "", ("In seconds.",))


@pytest.mark.parametrize("error", [None, math.nan, math.inf, "not given"])
def test_a_missing_value_is_an_error_that_names_the_part(prose, error):
    values = {} if error == "not given" else {"error": error}
    with pytest.raises(ValueError, match=r"texts\.md of made_prose, part 'intro': a value cannot be put in"):
        prose.text("intro", count=3, **values)


def test_a_missing_part_is_an_error_that_says_what_to_add(prose):
    with pytest.raises(KeyError, match="no part 'outro'; add '## outro' to it"):
        prose.text("outro")
    assert prose.has("intro")
    assert not prose.has("outro")


PAGES = {page.name: page for page in pages()}


@pytest.mark.parametrize("name", [name for name, page in PAGES.items() if page.results])
def test_without_a_result_a_page_says_how_to_make_one(name):
    section = PAGES[name].section(StoredResults())
    remarks = [block for block in section.blocks if isinstance(block, Callout)]
    assert section.blocks == () or any("`srbval " in remark.text for remark in remarks)


@pytest.mark.parametrize("name", PAGES)
def test_with_its_results_a_page_has_tables_and_figures_that_draw(name, tmp_path):
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


def test_lists_of_pages_are_joined_and_other_keys_added():
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
def test_the_origin_of_a_result_says_kind_date_machine_and_command(more, words):
    text = origin_of(StoredResult(path=Path("naming.json"), content=STORED | more)).text
    for part in (words, "2026-11-26T10:00:00+00:00", "A\\*B (2 usable cores)", "`srbval evidence naming`"):
        assert part in text


def test_a_study_page_starts_with_the_origin_or_the_command(monkeypatch):
    monkeypatch.setattr(Prose, "_parts", {"": "# Naming {#naming}", "found": "{n} of 3."})
    page = study_page("made.naming", 10, lambda prose, content: [prose.paragraph("found", n=content["n"])])
    result = StoredResult(path=Path("naming.json"), content=STORED | {"n": 2})
    origin, found = page.section(StoredResults({"naming": result})).blocks
    assert (origin, found) == (origin_of(result), Paragraph("2 of 3."))
    (remark,) = page.section(StoredResults()).blocks
    assert isinstance(remark, Callout)
    assert "`srbval evidence naming`" in remark.text


PACKAGE = Path(srbval.__file__).parent
ASSEMBLE = """
import srbval.cli, srbval.report.reports
from srbval.report.pages import joined_data, results_of
from srbval.studies.harness import pages, study_names
found = pages()
results = results_of(found)
sections = {(section := page.section(results)).id: section for page in found}
assert len(sections) == len(found) and all(section.blocks for section in sections.values())
joined_data({}, (page.data(results) for page in found))
print(",".join(page.name for page in found), ",".join(study_names()))
"""


def without(study: str, folder: Path) -> Path:
    """A copy of the package in which one study's folder is missing, and links to what ships beside it."""
    left_out = shutil.ignore_patterns("__pycache__", "docs")
    shutil.copytree(PACKAGE, folder / PACKAGE.name, ignore=left_out)
    shutil.rmtree(folder / PACKAGE.name / "studies" / study)
    for name in ("reports", "data_manifest"):
        (folder / name).symlink_to(PACKAGE.parent / name)
    return folder


STUDIES = [pytest.param(name, marks=[pytest.mark.long_form] * (place > 0)) for place, name in enumerate(study_names())]


@pytest.mark.parametrize("study", STUDIES)
def test_the_report_is_without_the_page_of_a_study_that_is_not_there_and_the_rest_stays(study, tmp_path):
    tree = without(study, tmp_path)
    done = subprocess.run(
        [sys.executable, "-c", ASSEMBLE],
        cwd=tree,
        env=os.environ | {"PYTHONPATH": str(tree)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr[-2000:]
    shown, left = (names.split(",") for names in done.stdout.split())
    assert left == [name for name in study_names() if name != study]
    assert shown == [page.name for page in pages() if page.name != study]
