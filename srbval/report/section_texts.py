"""The prose and the tables of a section as data: one TOML file for each section in `srbval/report/texts`.

A file holds the section's ``id`` and ``title`` and the tables ``text`` (a template or a list of templates by name),
``callout``, ``figure`` and ``table``. Sentences are Jinja templates, whole; a column of a table says what it is called,
its unit, its format and by which expression (over ``row`` and the values given) its cells are read. Consecutive columns
with the same ``for`` are repeated for each ``item`` of that expression, and so is the ``note`` of a table with
``note-for``. A table may be ``like`` another one in all that it does not say itself.
"""

import itertools
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, cached_property, lru_cache
from importlib import resources
from typing import Any, Self

from srbval.bearing import Fault
from srbval.comparison.budget import PRIOR, TOLERANCE, VERDICT
from srbval.models.run import USABLE
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin
from srbval.report.blocks import (
    Badge,
    Block,
    Callout,
    Cell,
    Column,
    Explore,
    Figure,
    FigureGrid,
    Listing,
    Paragraph,
    Section,
    Table,
    Tone,
    VerdictBox,
    format_value,
)
from srbval.report.figures.style import Drawing
from srbval.report.plain import literal

Entry = Mapping[str, Any]


class Texts:
    """Prose, tables and figure captions of the section whose file is ``texts/<name>.toml``, or of a study's page.

    `Texts.of_study` takes the name of the study's folder, which holds the page's ``texts.toml``.
    Every method takes the values that its templates name; a name that a template asks for and nobody gives is an error.
    Limits fixed before any comparison (`comparison.budget`) are there everywhere; a result is always given.
    """

    def __init__(self, name: str, package: str = "srbval.report", folder: str = "texts") -> None:
        self._place = (package, f"{folder}/{name}.toml".removeprefix("/"))

    @classmethod
    def of_study(cls, package: str) -> Self:
        """Those of a study's page, beside the module of that page; `package` is the module's ``__package__``."""
        return cls("texts", package, "")

    @cached_property
    def _content(self) -> Entry:
        package, path = self._place
        return tomllib.loads((resources.files(package) / path).read_text(encoding="utf-8"))

    @property
    def page(self) -> Entry:
        """The entry ``[page]`` of a study whose page is nothing but its texts; see `blocks`, `expressions`."""
        entry: Entry = self._content["page"]
        return entry

    def blocks(self, **given: Any) -> Iterator[Block]:
        """The ``blocks`` of that entry: their kind, their name, and ``values`` as expressions over those given."""
        for entry in self.page["blocks"]:
            yield getattr(self, entry["kind"])(entry["name"], **expressions(entry["values"], given))

    def section(self, *blocks: Block, **values: Any) -> Section:
        """The section with these blocks; blocks given as `appendix` are not shown."""
        title = _render(self._content["title"], values)
        return Section(id=self._content["id"], title=title, blocks=blocks)

    def text(self, name: str, /, **values: Any) -> str:
        """One text."""
        return _render(self._content["text"][name], values)

    def paragraph(self, name: str, /, **values: Any) -> Paragraph:
        """One text as a paragraph."""
        return Paragraph(self.text(name, **values))

    def listing(self, name: str, /, **values: Any) -> Listing:
        """A list of texts, those that come out empty left out."""
        items = (_render(item, values) for item in self._content["text"][name])
        return Listing(items=tuple(filter(None, items)))

    def each(self, name: str, rows: Iterable[Any], /) -> tuple[str, ...]:
        """The items of a list of texts for every `row`, those that come out empty left out."""
        return tuple(item for row in rows for item in self.listing(name, row=row).items)

    def callout(self, name: str, /, *, tone: Tone, **values: Any) -> Callout:
        """A boxed remark."""
        entry = self._content["callout"][name]
        return Callout(tone=tone, title=_render(entry.get("title", ""), values), text=_render(entry["text"], values))

    def verdict(self, tone: Tone, of: str = "", /, *, figure: Figure | None = None, **values: Any) -> VerdictBox:
        """The verdict with its text ``headline`` and its list ``points``, of the name `of` added, and its picture."""
        points = self.listing(f"points{of}", **values).items
        return VerdictBox(tone=tone, headline=self.text(f"headline{of}", **values), points=points, figure=figure)

    def figure(
        self, name: str, draw: Drawing, /, *, id: str = "", badge: str | None = None,
        explore: Explore | None = None, **values: Any,
    ) -> Figure:  # fmt: skip
        """A figure with its label, caption and alt text; `id` is `name` unless given."""
        entry = self._content["figure"][name]
        label, caption, alt = (_render(entry.get(key, ""), values) for key in ("label", "caption", "alt"))
        source = Badge(badge) if badge else None
        return Figure(
            id=id or name, draw=draw, badge=source, synthetic=source is Badge.STAND_IN,
            wide=entry.get("wide", True), label=label, caption=caption, alt=alt, explore=explore,
        )  # fmt: skip

    def grid(
        self, name: str, figures: Iterable[Figure], /, label: str = "", *, columns: int = 2, **values: Any
    ) -> FigureGrid:
        """Panels with the text `name` as their common caption."""
        return FigureGrid(figures=tuple(figures), columns=columns, label=label, caption=self.text(name, **values))

    def table(
        self, name: str, /, rows: Iterable[Any], *, id: str = "", further_notes: Iterable[str] = (), **values: Any
    ) -> Table:
        """A table of one row for each of `rows`; `further_notes` stand before its own, `id` is `name` unless given."""
        entry = self._content["table"][name]
        entry = self._content["table"].get(entry.get("like"), {}) | entry
        columns = list(_columns(entry["columns"], values))
        notes = [_render(note, values) for note in entry.get("notes", ())]
        if "note-for" in entry:
            notes += [_render(entry["note"], {**values, "item": item}) for item in _value(entry["note-for"], values)]
        return Table(
            id=id or name,
            label=_render(entry.get("label", ""), values),
            caption=_render(entry["caption"], values),
            columns=tuple(
                Column(
                    title=_render(column["title"], given),
                    **{key: column[key] for key in ("unit", "format") if key in column},
                )
                for column, given in columns
            ),
            rows=tuple(tuple(_cell(column, given | {"row": row}) for column, given in columns) for row in rows),
            notes=tuple(filter(None, (*further_notes, *notes))),
        )


def expressions(entries: Mapping[str, str], given: Mapping[str, Any]) -> dict[str, Any]:
    """What each expression of `entries` is of the values `given`."""
    return {key: _value(source, given) for key, source in entries.items()}


def _columns(entries: Iterable[Entry], values: Mapping[str, Any]) -> Iterator[tuple[Entry, dict[str, Any]]]:
    """Each column's entry with the values that its templates and expressions may name."""
    for items, group in itertools.groupby(entries, key=lambda entry: entry.get("for")):
        columns = list(group)
        for item in _value(items, values) if items else (None,):
            yield from ((column, {**values, "item": item}) for column in columns)


def _cell(entry: Entry, values: Mapping[str, Any]) -> Cell:
    found = {key: _value(entry[key], values) for key in ("value", "ci95", "badge", "tone") if key in entry}
    badge, tone = found.get("badge"), found.get("tone")
    return Cell(
        value=found["value"],
        ci95=found.get("ci95"),
        badge=Badge(badge) if badge else None,
        tone=Tone(tone) if tone else None,
        note=_render(entry.get("note", ""), values),
    )


def _render(source: str, values: Mapping[str, Any]) -> str:
    return str(_template(source).render(values))


@lru_cache(maxsize=1)
def _environment() -> Any:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(undefined=StrictUndefined, autoescape=False)
    environment.filters |= {"fmt": format_value, "literal": lambda value: literal(str(value))}
    environment.globals |= {"Fault": Fault, "USABLE": USABLE}
    environment.globals |= {"VERDICT": VERDICT, "PRIOR": PRIOR, "TOLERANCE": TOLERANCE}
    return environment


@cache
def _template(source: str) -> Any:
    """A compiled template; line breaks of its source are spaces."""
    return _environment().from_string(re.sub(r"\s*\n\s*", " ", source.strip()))


@cache
def _expression(source: str) -> Any:
    return _environment().compile_expression(source, undefined_to_none=False)


def _value(source: str, values: Mapping[str, Any]) -> Any:
    from jinja2 import Undefined

    found = _expression(source)(**values)
    if isinstance(found, Undefined):
        raise KeyError(f"{source!r} names nothing that the table has.")
    return found


SIDE_NAME = {Origin.MEASURED: "rig", Origin.SIMULATED: "model"}
VERDICT_TONE = {"resolved": "warning", "agrees": "good", "undecided": "neutral", "insufficient data": "neutral"}


def badge_of(analysis: Analysis) -> Badge:
    """Badge of what an analysis was made from."""
    return Badge(analysis.recording.origin.value)


def side_of(analysis: Analysis) -> str:
    """Which side of a comparison an analysis is, in words."""
    return SIDE_NAME[analysis.recording.origin]
