"""Page of the report: error of every model by question, with its time, and the least model that is enough."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from srbval.plan.questions import MEANING, Question
from srbval.report.blocks import Block, Tone
from srbval.report.pages import study_page
from srbval.report.prose import Prose
from srbval.report.tables import Title

SHOWN = ("paper", "rig")


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """One paragraph and a table for each scene."""
    scenes = max(row["scenes"] for row in content["bounds"])
    yield prose.paragraph("intro", scenes=scenes, percent=100 * scenes / (scenes + 1))
    for base in SHOWN:
        about, rows = content["bases"][base], [row for row in content["ladder"] if row["base"] == base]
        columns: dict[str, Title] = {"question": "Question"}
        columns |= {model: (model, f"{about['pace'][model]:.2g} s/s") for model in about["models"]}
        columns["least"] = "Least model"
        yield prose.table(f"{base}-levels", question_table(rows), columns, **about)


def question_table(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """One row for each question: every model's error as text, and the cheapest model that is enough."""
    found = []
    for question in dict.fromkeys(row["question"] for row in rows):
        own, asked = [row for row in rows if row["question"] == question], MEANING[Question(question)]
        line: dict[str, Any] = {"question": asked.title, "question_note": f"enough: {asked.tolerance:g} {asked.unit}"}
        for row in own:
            line[row["model"]], line[f"{row['model']}_note"] = _shown(row)
            line[f"{row['model']}_tone"] = Tone.GOOD if row["enough"] else None
        found.append(line | {"least": least(own) or "none"})
    return pd.DataFrame(found)


def least(rows: Sequence[Mapping[str, Any]]) -> str | None:
    """The cheapest model that is enough, of the rows of one question."""
    enough = [row for row in rows if row["enough"]]
    return str(min(enough, key=lambda row: row["wall_per_simulated_s"])["model"]) if enough else None


def _shown(row: Mapping[str, Any]) -> tuple[str, str]:
    """Median error with its interval, and below it the largest error or the number of scenes without an answer."""
    if row["enough"] is None:
        return "cannot answer", ""
    asked, sizes = MEANING[Question(row["question"])], (row["median_pct"], *row["ci95_pct"], row["error_pct"])
    middle, low, high, largest = ("-" if one is None else _digits(asked.shown(one)) for one in sizes)
    silent = f"no answer on {row['silent']} of {row['scenes']} scenes"
    return f"{middle} [{low}, {high}] {asked.unit}", silent if row["silent"] else f"at most {largest}"


def _digits(value: float) -> str:
    return "over 1000" if value > 1000 else f"{value:.3g}" if value >= 100 else f"{value:.2g}"


PAGE = study_page(__package__, 50, blocks, data=lambda content: {"ladder": content["ladder"]})
