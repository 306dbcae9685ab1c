"""The tree refuses what no renderer could show honestly; inline markup marks, text from elsewhere stays text."""

from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from srbval.report.blocks import (
    Cell,
    Column,
    Figure,
    FigureGrid,
    Report,
    Section,
    Table,
    Tone,
    VerdictBox,
    format_value,
)
from srbval.report.plain import literal, printable, spans


def nothing(folder: Path, name: str) -> None:
    """A picture that nobody draws."""


def figure(**changes):
    return Figure(**{"id": "fig11a", "caption": "c", "alt": "a", "draw": nothing} | changes)


def report(generated_utc, *sections):
    verdict = VerdictBox(tone=Tone.NEUTRAL, headline="h")
    return Report(title="t", generated_utc=generated_utc, sections=sections, verdict=verdict)


@pytest.mark.parametrize("changes", [{"alt": " "}, {"caption": ""}, {"id": "../up"}])
def test_a_figure_without_its_text_or_with_a_bad_name_cannot_be_built(changes):
    with pytest.raises(ValueError, match=r"fig11a|up"):
        figure(**changes)


def test_what_does_not_fit_together_is_refused():
    with pytest.raises(ValueError, match="row 1: 2 cells for 1 columns"):
        Table(id="t", caption="c", columns=(Column(title="x"),), rows=((Cell(value=1), Cell(value=2)),))
    with pytest.raises(ValueError, match="time zone"):
        report(datetime(2025, 1, 1))
    twice = Section(id="a", title="A", blocks=(figure(), FigureGrid(figures=(figure(),))))
    with pytest.raises(ValueError, match="'fig11a' is used twice"):
        report(datetime(2025, 1, 1, tzinfo=UTC), twice)


@pytest.mark.parametrize(
    ("value", "spec", "shown"),
    [
        (96.7949, ".2f", "96.79"),
        (-1.004, "+.2f", "-1.00"),
        (-0.0001, "+.2f", "0.00"),
        (None, ".2f", "–"),
        (True, "", "yes"),
        (12, "", "12"),
    ],
)
def test_values_are_shown_as_their_column_says(value, spec, shown):
    assert format_value(value, spec) == shown


@pytest.mark.parametrize(
    ("text", "runs"),
    [
        ("a **b** `c`", (("text", "a "), ("strong", "b"), ("text", " "), ("code", "c"))),
        ("2 * 3 ** 4 ` 5", (("text", "2 * 3 ** 4 ` 5"),)),
        (
            "+0.15 ± 0.21 % at 877 rpm, 2 m/s² in 1400 to 2800 Hz; 3 members, `2 m`",
            (
                (
                    "text",
                    "+0.15\u00a0±\u00a00.21\u00a0% at 877\u00a0rpm, 2\u00a0m/s² in 1400 to 2800\u00a0Hz; 3 members, ",
                ),
                ("code", "2 m"),
            ),
        ),
    ],
)
def test_markers_mark_and_no_line_ends_within_a_quantity(text, runs):
    assert spans(text) == runs


@given(st.text())
def test_literal_text_comes_back_unchanged_as_one_run(text):
    """But for the kind of its blanks; controls and direction overrides are replaced."""
    expected = printable(text).replace("\u00a0", " ")
    found = tuple((kind, part.replace("\u00a0", " ")) for kind, part in spans(literal(text)))
    assert found == ((("text", expected),) if expected else ())
    assert printable("a\x00b\u202ec\ud800") == "a\ufffdb\ufffdc\ufffd"
