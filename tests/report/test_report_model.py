"""The tree refuses what no renderer could show honestly."""

from datetime import UTC, datetime
from pathlib import Path

import pytest

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
from srbval.report.figures.style import PanelFiles


def nothing(folder: Path, name: str) -> PanelFiles:
    return PanelFiles(picture=folder / f"{name}.svg", data=folder / f"{name}.csv")


def figure(**changes):
    given = {"id": "fig11a", "caption": "c", "alt": "a", "draw": nothing} | changes
    return Figure(**given)


@pytest.mark.parametrize("changes", [{"alt": " "}, {"caption": ""}, {"id": "../up"}, {"suffix": ".exe"}])
def test_a_figure_without_its_text_or_with_a_bad_name_cannot_be_built(changes):
    with pytest.raises(ValueError, match=r"fig11a|up"):
        figure(**changes)


def test_a_row_of_the_wrong_length_is_refused():
    with pytest.raises(ValueError, match="row 1: 2 cells for 1 columns"):
        Table(id="t", caption="c", columns=(Column(title="x"),), rows=((1, 2),))


def test_an_id_can_be_used_once_only():
    sections = (Section(id="a", title="A", blocks=(figure(), FigureGrid(figures=(figure(),)))),)
    with pytest.raises(ValueError, match="'fig11a' is used twice"):
        Report(
            title="t", generated_utc=datetime(2025, 1, 1, tzinfo=UTC), sections=sections,
            verdict=VerdictBox(tone=Tone.NEUTRAL, headline="h"),
        )  # fmt: skip


def test_a_report_must_know_its_time_zone():
    with pytest.raises(ValueError, match="time zone"):
        Report(
            title="t", generated_utc=datetime(2025, 1, 1), sections=(),
            verdict=VerdictBox(tone=Tone.NEUTRAL, headline="h"),
        )  # fmt: skip


@pytest.mark.parametrize(
    ("value", "spec", "shown"),
    [
        (96.7949, ".2f", "96.79"), (-1.004, "+.2f", "-1.00"), (-0.0001, "+.2f", "0.00"), (None, ".2f", "–"),
        (float("inf"), ".2f", "–"), (True, "", "yes"), ("text", ".2f", "text"), (12, "", "12"),
    ],
)  # fmt: skip
def test_values_are_shown_as_their_column_says(value, spec, shown):
    assert format_value(value, spec) == shown


def test_an_interval_is_shown_with_its_value_and_never_with_a_missing_one():
    column = Column(title="f", format="+.2f")
    assert Cell(value=1.0, ci95=0.25).text(column) == "+1.00 ± 0.25"
    assert Cell(value=None, ci95=0.25).text(column) == "–"
