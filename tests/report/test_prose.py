"""Prose in Markdown: parts by name, values put in, and an error for each missing value or part."""

import math
import sys
from pathlib import Path

import pytest

from srbval.report.blocks import Badge, Callout, Figure, Listing, Paragraph, Tone
from srbval.report.plain import spans
from srbval.report.prose import Prose

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
def prose(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Prose:
    """The source above as the file of a package."""
    package = tmp_path / "made_prose"
    package.mkdir()
    (package / "__init__.py").touch()
    (package / "texts.md").write_text(SOURCE, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "made_prose", raising=False)
    return Prose("made_prose")


def test_texts_take_values_and_keep_foreign_text_literal(prose: Prose) -> None:
    assert prose.paragraph("intro", count=3, error=0.1234) == Paragraph("The mean of 3 runs is +0.12 %.")
    listing = prose.listing("points", file="a**b**")
    assert isinstance(listing, Listing)
    assert listing.items[1] == "Second over two lines."
    assert spans(listing.items[0]) == (("strong", "First"), ("text", ": a**b**"))
    assert prose.text("intro", count=3, error=-0.001) == "The mean of 3 runs is 0.00 %."


def test_section_callout_figure_and_table(prose: Prose) -> None:
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
def test_a_missing_value_is_an_error_that_names_the_part(prose: Prose, error: object) -> None:
    values = {} if error == "not given" else {"error": error}
    with pytest.raises(ValueError, match=r"texts\.md of made_prose, part 'intro': a value cannot be put in"):
        prose.text("intro", count=3, **values)


def test_a_missing_part_is_an_error_that_says_what_to_add(prose: Prose) -> None:
    with pytest.raises(KeyError, match="no part 'outro'; add '## outro' to it"):
        prose.text("outro")
    assert prose.has("intro")
    assert not prose.has("outro")
