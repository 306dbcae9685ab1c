"""Page of the report: error of every model by question, with its time, and the least model that is enough."""

from collections.abc import Iterator, Mapping
from typing import Any

import pandas as pd

from srbval.report.blocks import Block, Tone
from srbval.report.pages import study_page
from srbval.report.prose import Prose
from srbval.studies.model_levels.study import POINTS, summary

SHOWN = ("paper", "rig")


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """One paragraph and a table for each scene."""
    rows = summary(content)
    yield prose.paragraph("intro", points=POINTS, percent=100 * POINTS / (POINTS + 1))
    for base in SHOWN:
        about = content["bases"][base]
        titles = {model: (model, f"{about['pace'].get(model, 0):.2g} s/s") for model in about["models"]}
        columns = {"question": "Question", **titles, "least": "Least model"}
        table = question_table([row for row in rows if row["base"] == base])
        yield prose.table(f"{base}-levels", table, columns, reference=about["reference_text"], seconds=about["seconds"])


def question_table(rows: list[dict[str, Any]]) -> pd.DataFrame:
    """One row for each question: every model's error as text, and the cheapest model that is enough."""
    found = []
    for title in dict.fromkeys(row["title"] for row in rows):
        own = [row for row in rows if row["title"] == title]
        line = {"question": title, "question_note": f"enough within {own[0]['tolerance']:g} {own[0]['unit']}"}
        for row in own:
            line |= {row["model"]: _error(row), f"{row['model']}_note": _note(row)}
            line[f"{row['model']}_tone"] = Tone.GOOD if row["enough"] else None
        found.append(line | {"least": least(own) or "none"})
    return pd.DataFrame(found)


def least(rows: list[dict[str, Any]]) -> str | None:
    """The cheapest model that is enough, of the rows of one question."""
    enough = [row for row in rows if row["enough"]]
    return min(enough, key=lambda row: row["wall_per_simulated_s"])["model"] if enough else None


def _error(row: Mapping[str, Any]) -> str:
    """Median error with its interval."""
    if row["enough"] is None:
        return "cannot answer"
    low, middle, high = ("-" if row[name] is None else f"{row[name]:.2g}" for name in ("low", "median", "high"))
    return f"{middle} [{low}, {high}] {row['unit']}"


def _note(row: Mapping[str, Any]) -> str:
    """The largest error, and the scenes without an answer."""
    if row["enough"] is None:
        return ""
    silent = f"none on {row['unanswered']} of {row['scenes']} scenes" if row["unanswered"] else ""
    return silent or f"at most {row['worst']:.2g}"


PAGE = study_page(__package__, 50, blocks, data=lambda content: {"ladder": summary(content)})
