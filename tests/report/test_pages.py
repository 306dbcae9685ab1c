"""Prose in Markdown, blocks and tables from frames; pages of studies with and without a result or a study."""

import math
import os
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

import srbval
from srbval.bearing import load_bearing
from srbval.report.blocks import Callout, Paragraph, TableColumn, cell_text
from srbval.report.findings.findings import select_at_paper_load, select_simulated
from srbval.report.findings.records import fault_cursors
from srbval.report.pages import Page, origin_line
from srbval.report.prose import Prose, literal
from srbval.report.renderers import mask_controls, spans
from srbval.storage.stored_result import StoredResult, newest_result
from srbval.studies.harness import pages, study_names

SOURCE = """# Cage speed of {bearing} {#cage-speed}

## intro
The mean of {count} runs
is {error:+.2f} %.

## points
- **First**: {file!l}
- Second
  over two lines.

## limits.caption
Limits.
## limits.notes
- In seconds.
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
    first, second = prose.items("points", file="a**b**")
    assert second == "Second over two lines."
    assert spans(first) == (("strong", "First"), ("text", ": a**b**"))
    assert prose.text("intro", count=3, error=-0.001) == "The mean of 3 runs is 0.00 %."


@pytest.mark.parametrize("error", [None, math.nan, math.inf, "not given"])
def test_a_missing_value_or_part_is_an_error_that_names_the_part(prose, error):
    values = {} if error == "not given" else {"error": error}
    with pytest.raises(ValueError, match=r"texts\.md of made_prose: a value .* the part 'intro'"):
        prose.text("intro", count=3, **values)
    with pytest.raises(KeyError, match="no part 'outro'; add '## outro' to it"):
        prose.text("outro")


STORED = {"made_utc": "2026-11-26T10:00:00+00:00", "machine": {"processor": "A*B", "usable_cores": 2}}
STORED |= {"command": "srbval evidence naming", "git_revision": "abc"}


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ({}, "**Stored evidence** of"),
        ({"evidence_kind": "recorded"}, "**Stored record** of"),
        ({"computed_once": "a prediction"}, "**Stored document** of"),
    ],
)
def test_the_origin_of_a_result_says_kind_date_machine_and_command(more, words):
    for part in (words, "2026-11-26 10:00 UTC", "A\\*B", "`srbval evidence naming`"):
        result = StoredResult(path=Path("naming.json"), content=STORED | more)
        assert part in origin_line({"naming": result}, "naming").text


def test_a_study_page_starts_with_the_origin_or_the_command(monkeypatch):
    monkeypatch.setattr(Prose, "_parts", {"": "# Naming {#naming}", "found": "{n} of 3."})
    page = Page("made.naming", 10, lambda prose, content: [prose.paragraph("found", n=content["n"])])
    results = {"naming": StoredResult(path=Path("naming.json"), content=STORED | {"n": 2})}
    assert page.section(results).blocks == (origin_line(results, "naming"), Paragraph("2 of 3."))
    (remark,) = page.section({}).blocks
    assert isinstance(remark, Callout)
    assert "`srbval evidence naming`" in remark.text


PACKAGE = Path(srbval.__file__).parent
ASSEMBLE = """
import srbval.cli, srbval.report.reports
from srbval.report.pages import join_data, load_newest_results
from srbval.studies.harness import pages, study_names
found = pages()
results = load_newest_results(found)
sections = {(section := page.section(results)).id: section for page in found}
assert len(sections) == len(found) and all(section.blocks for section in sections.values())
join_data({}, (page.data(results[page.name].content, results) for page in found))
print(",".join(page.name for page in found), ",".join(study_names()))
"""


def without(study: str, folder: Path) -> Path:
    """Copy the package without one study's folder, and link what ships beside it."""
    shutil.copytree(PACKAGE, folder / PACKAGE.name, ignore=shutil.ignore_patterns("__pycache__", "docs"))
    shutil.rmtree(folder / PACKAGE.name / "studies" / study)
    for name in ("reports", "data_manifest"):
        (folder / name).symlink_to(PACKAGE.parent / name)
    return folder


STUDIES = [pytest.param(name, marks=[pytest.mark.long_form] * (place > 0)) for place, name in enumerate(study_names())]


@pytest.mark.parametrize("study", STUDIES)
def test_the_report_is_without_the_page_of_a_study_that_is_not_there_and_the_rest_stays(study, tmp_path):
    tree = without(study, tmp_path)
    own = {"cwd": tree, "env": os.environ | {"PYTHONPATH": str(tree)}}
    done = subprocess.run([sys.executable, "-c", ASSEMBLE], capture_output=True, text=True, check=False, **own)
    assert done.returncode == 0, done.stderr[-2000:]
    shown, left = (names.split(",") for names in done.stdout.split())
    assert left == [name for name in study_names() if name != study]
    assert shown == [page.name for page in pages() if page.name != study]


FIXED = "\u00a0"  # a blank at which no line ends
TOGETHER = "+0.15_±_0.21_% at 877_rpm, 2_m/s² in 1400 to 2800_Hz; 3 members, ".replace("_", FIXED)


@pytest.mark.parametrize(
    ("text", "runs"),
    [
        ("a **b** `c`", (("text", "a "), ("strong", "b"), ("text", " "), ("code", "c"))),
        ("2 * 3 ** 4 ` 5", (("text", "2 * 3 ** 4 ` 5"),)),
        (f"{TOGETHER.replace(FIXED, ' ')}`2 m`", (("text", TOGETHER), ("code", "2 m"))),
    ],
)
def test_markers_mark_and_no_line_ends_within_a_quantity(text, runs):
    assert spans(text) == runs


@given(st.text())
def test_literal_text_comes_back_unchanged_as_one_run(text):
    """But for the kind of its blanks; controls and direction overrides are replaced."""
    expected = mask_controls(text).replace("\u00a0", " ")
    found = tuple((kind, part.replace("\u00a0", " ")) for kind, part in spans(literal(text)))
    assert found == ((("text", expected),) if expected else ())
    assert mask_controls("a\x00b\u202ec\ud800") == "a\ufffdb\ufffdc\ufffd"


COLUMNS = {
    "name": TableColumn("Scene"),
    "error": TableColumn("Error", "%", "+.2f"),
    "runs": TableColumn("Runs", "", "d"),
}


def test_a_frame_is_shown_with_its_companions_and_its_gaps(prose):
    companions = {"ci95": [0.05, None], "tone": ["good", None], "badge": ["measured", np.nan], "note": ["of 3", None]}
    frame = pd.DataFrame(
        {"name": ["paper", "rig"], "error": [0.123, np.nan], "runs": [3, None], "not_shown": [[1], [2]]}
    )
    frame = frame.assign(**{f"error_{name}": values for name, values in companions.items()})
    table = prose.table("limits", frame, COLUMNS, more_notes=["one", ""])
    shown = {key: column.format for key, column in COLUMNS.items()}
    texts = [[cell_text(row[key], row.get(f"{key}_ci95"), shown[key]) for key in shown] for row in table.rows]
    assert texts == [["paper", "+0.12 ± 0.05", "3"], ["rig", "–", "–"]]
    known = {"error_ci95": 0.05, "error_badge": "measured", "error_tone": "good", "error_note": "of 3"}
    assert table.rows[0] == {"name": "paper", "error": 0.123, "runs": 3} | known
    assert table.rows[1] == {"name": "rig", "error": None, "runs": None}
    assert table.notes == ("one", "In seconds.")
    assert table.columns == COLUMNS


def test_cursors_are_named_as_the_field_does():
    line, bearing = SimpleNamespace(name="BPFI", kinematic_hz=128.0), load_bearing("skf-22240")
    view = SimpleNamespace(shaft_hz=12.0, analysis=SimpleNamespace(bearing=bearing))
    names = [c.name for c in fault_cursors(view, line, 270, 1)]
    assert names == ["BPFI-fr", "BPFI", "BPFI+fr", "2xBPFI-fr", "2xBPFI", "2xBPFI+fr"]


def test_a_record_at_a_speed_or_load_without_stored_draws_has_no_part_in_the_verdicts():
    points = ((124.8, 353.0), (124.8, 997.0), (62.4, 353.0))
    own, fast, light = (SimpleNamespace(radial_kn=kn, axial_kn=0.0, nominal_rpm=rpm) for kn, rpm in points)
    assert select_at_paper_load([own, fast, light]) == [own, fast]
    assert select_simulated([own, fast], newest_result("inputs").content) == [own]
    assert select_simulated([own, fast], {}) == [own, fast]
