"""Tables straight from frames: companions, gaps, kinds of value, and errors that name the remedy."""

import numpy as np
import pandas as pd
import pytest

from srbval.report.blocks import Badge, Table, Tone
from srbval.report.tables import frame_table

COLUMNS = {"name": "Scene", "error": ("Error", "%", "+.2f"), "runs": ("Runs", "", "d")}


def _shown(table: Table) -> list[list[str]]:
    return [[cell.text(column) for cell, column in zip(row, table.columns, strict=True)] for row in table.rows]


def test_a_frame_is_shown_with_its_companions_and_its_gaps() -> None:
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
    assert (first.badge, first.tone, first.note) == (Badge.MEASURED, Tone.GOOD, "of 3")
    assert (second.ci95, second.badge, second.tone, second.note) == (None, None, None, "")
    assert (table.label, table.notes) == ("Table 1", ("one",))
    heads = [(column.title, column.unit, column.align) for column in table.columns]
    assert heads == [("Scene", "", "left"), ("Error", "%", "right"), ("Runs", "", "right")]


def test_an_unknown_column_and_a_cell_with_several_values_are_errors() -> None:
    with pytest.raises(KeyError, match="no column 'runs'; it has name, error"):
        frame_table([{"name": "a", "error": 1.0}], id="t", caption="x", columns=COLUMNS)
    with pytest.raises(TypeError, match="'Scene': a cell holds one value, not list"):
        frame_table([{"name": ["a"]}], id="t", caption="x", columns={"name": "Scene"})
