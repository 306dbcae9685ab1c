"""Report page: error and time of every model by question (a simulated quantity), and the cheapest accurate model."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd

from srbval.plan.questions import MEANING, Question
from srbval.report.blocks import Block, Callout, TableColumn, Tone
from srbval.report.pages import Page
from srbval.report.prose import Prose

SCENE_TITLES = {"paper": "paper's scene", "rig": "rig's scene"}
ASKED = ("lines", "harmonic-levels", "sideband-levels", "noise-floor", "slip", "power", "amplitude", "levels")
TILE_QUESTIONS = ("power", "levels")  # in the tile, beside fault lines


def blocks(prose: Prose, content: Mapping[str, Any]) -> Iterator[Block]:
    """Build a paragraph for the page and a table for each scene."""
    scenes = max(row["scenes"] for row in content["bounds"])
    yield prose.paragraph("intro", scenes=scenes, percent=100 * scenes / (scenes + 1))
    for base in SCENE_TITLES:
        about, rows = content["bases"][base], [one for question in ASKED for one in _asked(content, base, question)]
        columns = {"question": TableColumn("Question")}
        columns |= {model: TableColumn(model, f"{about['pace'][model]:.2g} s/s") for model in about["models"]}
        columns["least"] = TableColumn("Least model")
        yield prose.table(f"{base}-levels", question_table(rows), columns, **about)


def question_table(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Table with a row for each question (a simulated quantity): each model's error, the cheapest accurate model."""
    found = []
    for question in dict.fromkeys(row["question"] for row in rows):
        own, asked = [row for row in rows if row["question"] == question], MEANING[Question(question)]
        line: dict[str, Any] = {"question": asked.title, "question_note": f"enough: {asked.tolerance:g} {asked.unit}"}
        for row in own:
            line[row["model"]], line[f"{row['model']}_note"] = _shown(row)
            line[f"{row['model']}_tone"] = Tone.GOOD if row["enough"] else None
        found.append(line | {"least": cheapest_model(own) or "none"})
    return pd.DataFrame(found)


def cheapest_model(rows: Sequence[Mapping[str, Any]]) -> str | None:
    """Cheapest model whose error is within the tolerance, None if no model is; `rows` has a row for each model."""
    enough = [row for row in rows if row["enough"]]
    return str(min(enough, key=lambda row: row["wall_per_simulated_s"])["model"]) if enough else None


def tile(prose: Prose, content: Mapping[str, Any]) -> Callout:
    """Summary for the report: the cheapest accurate model for fault lines, for levels and for drive power."""
    lines, pace = cheapest_model(_asked(content, "paper", "lines")) or "none", content["bases"]["paper"]["pace"]
    rest = []
    for question in TILE_QUESTIONS:
        asked, found = MEANING[Question(question)], []
        for base, scene in SCENE_TITLES.items():
            model = cheapest_model(_asked(content, base, question))
            time = f", {content['bases'][base]['pace'][model]:.2g} s" if model else ""
            found.append(f"{model or 'none'} ({scene}{time})")
        rest.append(f"{asked.title.capitalize()} within {asked.tolerance:g} {asked.unit}: {', '.join(found)}")
    words = {"lines": lines, "time": f"{pace[lines]:.1g} s" if lines in pace else "no time", "rest": ". ".join(rest)}
    return prose.callout("tile", tone=Tone.NEUTRAL, **words, tolerance=MEANING[Question.LINES].tolerance)


def _asked(content: Mapping[str, Any], base: str, question: str) -> list[Mapping[str, Any]]:
    return [row for row in content["ladder"] if (row["base"], row["question"]) == (base, question)]


def _shown(row: Mapping[str, Any]) -> tuple[str, str]:
    """Median error with its interval, and the largest error or the number of scenes without an answer, as texts."""
    if row["enough"] is None:
        return "", ""
    asked, sizes = MEANING[Question(row["question"])], (row["median_pct"], *row["ci95_pct"], row["error_pct"])
    middle, low, high, largest = ("-" if one is None else _digits(asked.shown(one)) for one in sizes)
    silent = f"no answer: {row['silent']} of {row['scenes']}"
    return f"{middle} [{low}, {high}] {asked.unit}", silent if row["silent"] else f"≤ {largest}"


def _digits(value: float) -> str:
    return "10³+" if value > 1000 else f"{value:.3g}" if value >= 99 else f"{value:.2g}"


PAGE = Page(__package__, 70, blocks, lambda content, _: {"ladder": content["ladder"]}, tile)
