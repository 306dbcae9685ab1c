"""Texts of a section, read from a Markdown file in which values are inserted, without conditions or loops.

A file starts with ``# Title {#id}``. A part is ``## name`` followed by its text; each line that begins with ``- `` is
an item of a list. A figure, table or callout NAME has the parts ``NAME.caption``, ``NAME.alt``, ``NAME.label`` (the
bold start of the caption) and ``NAME.title``; a table also has the lists ``NAME.notes`` and ``NAME.columns``, whose
items are ``key | title | unit | format`` (see `Prose.table`).

`str.format` inserts values such as ``{error_pct:+.2f}``; ``{name!l}`` escapes markup in a text from a file or a
recording. A missing value (not given, None, not finite) raises ValueError: no text is printed with a gap.
"""

import math
import re
from collections.abc import Iterable, Mapping
from functools import cached_property
from importlib import resources
from string import Formatter
from typing import Any

import pandas as pd

from srbval.report import blocks
from srbval.report.blocks import OF_VALUE, Figure, FigureGrid, ReportTable, Section, TableColumn, Tone, format_value
from srbval.report.figures.style import Drawing

FIGURE_OPTIONS = ("badge", "wide", "small_of", "explore")
_TITLE = re.compile(r"#\s+(?P<title>.+?)\s*\{#(?P<id>[a-z0-9-]+)\}\s*")
_PART_HEADING = re.compile(r"^##[ \t]+(\S+)[ \t]*$", re.MULTILINE)
_ITEM_START = re.compile(r"^- ", re.MULTILINE)


def literal(text: str) -> str:
    """Escape the markup characters of a text, so that it is printed unchanged."""
    return re.sub(r"([*`\\])", r"\\\1", text)


class Prose:
    """Texts of one section from a Markdown file of a package, such as ``texts.md`` of a study."""

    def __init__(self, package: str, file: str = "texts.md") -> None:
        self._package, self._file = package, file

    @cached_property
    def _parts(self) -> Mapping[str, str]:
        """Source text of every part by its name; the head of the file has the name ``""``."""
        source = (resources.files(self._package) / self._file).read_text(encoding="utf-8")
        head, *parts = _PART_HEADING.split(source)
        return {"": head, **dict(zip(parts[::2], parts[1::2], strict=True))}

    def _source(self, name: str) -> str:
        if name not in self._parts:
            raise KeyError(f"{self._file} of {self._package} has no part {name!r}; add '## {name}' to it.")
        return self._parts[name]

    def _filled(self, source: str, name: str, values: Mapping[str, Any]) -> str:
        try:
            return _FILL.vformat(" ".join(source.split()), (), values)
        except (ValueError, KeyError, AttributeError, TypeError, IndexError) as error:
            why = f"a value cannot be inserted into the part {name!r} ({type(error).__name__}: {error})"
            raise ValueError(f"{self._file} of {self._package}: {why}.") from error

    def text(self, name: str, /, **values: Any) -> str:
        """Return the part `name` of the section's text file as one line of text, with `values` inserted."""
        return self._filled(self._source(name), name, values)

    def items(self, name: str, /, **values: Any) -> tuple[str, ...]:
        """Return the items of the list `name` in the section's text file, with `values` inserted."""
        return tuple(self._filled(item, name, values) for item in _ITEM_START.split(self._source(name))[1:])

    def paragraph(self, name: str, /, **values: Any) -> blocks.Paragraph:
        """Make a paragraph from the part `name` of the section's text file, with `values` inserted."""
        return blocks.Paragraph(self.text(name, **values))

    def callout(self, name: str, /, *, tone: Tone, **values: Any) -> blocks.Callout:
        """Make a box, coloured by `tone`, from the part `name` of the section's text file, with `values` inserted."""
        return blocks.Callout(tone=tone, title=self._optional(f"{name}.title", values), text=self.text(name, **values))

    def figure(self, name: str, draw: Drawing, /, *, id: str = "", label: str = "", **values: Any) -> Figure:
        """Make a figure with the caption, alternative text and label under `name` in the section's text file.

        By default `id` is `name`, and `label` is from the file. `values` are inserted into the texts, or are options of
        `Figure`: `badge`, `wide`, `small_of`, `explore`.
        """
        return Figure(
            id=id or name,
            draw=draw,
            label=label or self._optional(f"{name}.label", values),
            caption=self.text(f"{name}.caption", **values),
            alt=self.text(f"{name}.alt", **values),
            **{option: values[option] for option in FIGURE_OPTIONS if option in values},
        )

    def grid(self, name: str, figures: Iterable[Figure], label: str = "", most: int = 2, **values: Any) -> FigureGrid:
        """Arrange figures, up to `most` per row, captioned by `label` and part `name` of the section's text file."""
        shown = tuple(figures)
        return FigureGrid(figures=shown, columns=min(most, len(shown)), label=label, caption=self.text(name, **values))

    def table(
        self,
        name: str,
        frame: pd.DataFrame | Iterable[Mapping[str, Any]],
        /,
        columns: Mapping[str, TableColumn] | None = None,
        *,
        id: str = "",
        more_notes: Iterable[str] = (),
        **values: Any,
    ) -> ReportTable:
        """Make a table with one row for each row of `frame`, a pandas frame or a list of mappings with the same keys.

        The keys of `columns` are names of the frame's columns; for the frame's columns ``X_ci95``, ``X_badge``,
        ``X_tone`` and ``X_note`` see `ReportTable`. The texts, and by default the columns, are from the section's text
        file; `more_notes` precede the notes in that file. Raises KeyError if the frame lacks a column.
        """
        table = frame if isinstance(frame, pd.DataFrame) else pd.DataFrame(list(frame))
        shown = self.columns(name, **values) if columns is None else columns
        missing = next((key for key in shown if key not in table.columns), None)
        if missing and len(table):
            raise KeyError(f"table {name!r}: the frame has no column {missing!r}; it has {', '.join(table.columns)}.")
        kept = table[[key for key in (f"{one}{of}" for one in shown for of in OF_VALUE) if key in table]]
        rows = kept.astype(object).where(kept.notna(), None).to_dict("records")
        notes = self.items(f"{name}.notes", **values) if f"{name}.notes" in self._parts else ()
        return ReportTable(
            id=id or name,
            caption=self.text(f"{name}.caption", **values),
            label=self._optional(f"{name}.label", values),
            notes=tuple(filter(None, (*more_notes, *notes))),
            columns=shown,
            rows=tuple({key: one for key, one in row.items() if key in shown or one not in (None, "")} for row in rows),
        )

    def columns(self, name: str, /, **values: Any) -> dict[str, TableColumn]:
        """Return title, unit and format of the columns of the table `name`, by key, from the section's text file."""
        rows = [[part.strip() for part in row.split("|")] for row in self.items(f"{name}.columns", **values)]
        return {key: TableColumn(*about) for key, *about in rows}

    def section(self, *blocks: Any) -> Section:
        """Make the section from its `blocks`, with the title and the id in the first line of its text file."""
        found = _TITLE.fullmatch(self._parts[""].strip())
        if found is None:
            raise ValueError(f"{self._file} of {self._package}: its first line must be '# Title {{#id}}'.")
        return Section(id=found["id"], title=found["title"], blocks=blocks)

    def _optional(self, name: str, values: Mapping[str, Any]) -> str:
        return self.text(name, **values) if name in self._parts else ""


class _Fill(Formatter):
    """Formatter that raises ValueError for missing values, formats numbers as tables do, escapes markup (``!l``)."""

    def format_field(self, value: Any, format_spec: str) -> str:
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            raise ValueError(f"the value is {value}")
        return format_value(value, format_spec) if isinstance(value, int | float) else format(value, format_spec)

    def convert_field(self, value: Any, conversion: str | None) -> Any:
        return literal(str(value)) if conversion == "l" else super().convert_field(value, conversion)


_FILL = _Fill()
