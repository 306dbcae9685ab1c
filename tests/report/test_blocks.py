"""Blocks of a report: refused if no renderer could show them honestly; tables straight from frames; names of lines."""

from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from srbval.comparison.table6 import table6
from srbval.report import blocks
from srbval.report.findings.gather import at_drawn_points
from srbval.report.findings.records import fault_cursors, tall_peaks
from srbval.report.plain import literal, printable, spans
from srbval.report.tables import frame_table
from srbval.storage.stored_result import newest_result


def nothing(folder: Path, name: str) -> None:
    """A picture that nobody draws."""


def figure(**changes):
    return blocks.Figure(**{"id": "fig11a", "caption": "c", "alt": "a", "draw": nothing} | changes)


def report(generated_utc, *sections):
    verdict = blocks.VerdictBox(tone=blocks.Tone.NEUTRAL, headline="h")
    return blocks.Report(title="t", generated_utc=generated_utc, sections=sections, verdict=verdict)


@pytest.mark.parametrize("changes", [{"alt": " "}, {"caption": ""}, {"id": "../up"}])
def test_a_figure_without_its_text_or_with_a_bad_name_cannot_be_built(changes):
    with pytest.raises(ValueError, match=r"fig11a|up"):
        figure(**changes)


def test_what_does_not_fit_together_is_refused():
    with pytest.raises(ValueError, match="row 1: 2 cells for 1 columns"):
        blocks.Table(
            id="t",
            caption="c",
            columns=(blocks.Column(title="x"),),
            rows=((blocks.Cell(value=1), blocks.Cell(value=2)),),
        )
    with pytest.raises(ValueError, match="time zone"):
        report(datetime(2025, 1, 1))
    twice = blocks.Section(id="a", title="A", blocks=(figure(), blocks.FigureGrid(figures=(figure(),))))
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
    assert blocks.format_value(value, spec) == shown


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


COLUMNS = {"name": "Scene", "error": ("Error", "%", "+.2f"), "runs": ("Runs", "", "d")}


def _shown(table: blocks.Table) -> list[list[str]]:
    return [[cell.text(column) for cell, column in zip(row, table.columns, strict=True)] for row in table.rows]


def test_a_frame_is_shown_with_its_companions_and_its_gaps():
    frame = pd.DataFrame(
        {
            "name": ["paper", "rig"],
            "error": np.array([0.123, np.nan]),
            "error_ci95": [0.05, None],
            "error_tone": ["good", None],
            "error_badge": ["measured", np.nan],
            "error_note": ["of 3", None],
            "runs": [3, None],
            "not_shown": [[1], [2]],
        }
    )
    table = frame_table(frame, id="t", caption="Errors.", columns=COLUMNS, label="Table 1", notes=["one", ""])
    assert _shown(table) == [["paper", "+0.12 ± 0.05", "3"], ["rig", "–", "–"]]
    first, second = table.rows[0][1], table.rows[1][1]
    assert (first.badge, first.tone, first.note) == (blocks.Badge.MEASURED, blocks.Tone.GOOD, "of 3")
    assert (second.ci95, second.badge, second.tone, second.note) == (None, None, None, "")
    assert (table.label, table.notes) == ("Table 1", ("one",))
    heads = [(column.title, column.unit, column.align) for column in table.columns]
    assert heads == [("Scene", "", "left"), ("Error", "%", "right"), ("Runs", "", "right")]


def test_an_unknown_column_and_a_cell_with_several_values_are_errors():
    with pytest.raises(KeyError, match="no column 'runs'; it has name, error"):
        frame_table([{"name": "a", "error": 1.0}], id="t", caption="x", columns=COLUMNS)
    with pytest.raises(TypeError, match="'Scene': a cell holds one value, not list"):
        frame_table([{"name": ["a"]}], id="t", caption="x", columns={"name": "Scene"})


def test_cursors_are_named_as_the_field_does():
    names = [c.name for c in fault_cursors("BPFI", 128.0, 270, sideband_hz=12.0, sidebands=1)]
    assert names == ["BPFI-fr", "BPFI", "BPFI+fr", "2xBPFI-fr", "2xBPFI", "2xBPFI+fr"]


def test_tall_peaks_are_named_by_what_they_are():
    frequency = np.arange(0, 6000) * 0.1
    height = np.full(frequency.size, 0.01)
    peaks = {11.83: "fr", 96.79: "BPFO", 193.58: "2xBPFO", 102.7: "BPFO+0.50fr", 340.0: "28.73fr", 256.08: None}
    for hz, tall in zip(peaks, (1.0, 0.9, 0.5, 0.6, 0.7, 1.0), strict=True):
        height[round(10 * hz)] = tall
    height[round(10 * 500.0)] = 0.3  # below a third of the tallest
    found = tall_peaks(
        frequency,
        height,
        600.0,
        shaft_hz=11.833,
        marked_hz=[128.04, 256.08],
        orders={"fr": 1.0, "BPFO": 8.1794, "BPFI": 10.8206, "FTF": 0.4305},
    )
    assert {round(hz, 1): name for name, hz, _ in found} == {round(hz, 1): n for hz, n in peaks.items() if n}
    assert [tall for _, _, tall in found] == sorted((tall for _, _, tall in found), reverse=True)


def test_a_record_at_a_speed_or_load_without_stored_draws_has_no_part_in_the_verdicts():
    points = ((124.8, 353.0), (124.8, 997.0), (62.4, 353.0))
    own, fast, light = (SimpleNamespace(radial_kn=kn, axial_kn=0.0, nominal_rpm=rpm) for kn, rpm in points)
    assert at_drawn_points([own, fast, light], table6(), newest_result("inputs").content) == [own]
    assert at_drawn_points([own, fast, light], table6(), {}) == [own, fast]
