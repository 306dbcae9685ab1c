"""The report as a small tree of frozen dataclasses; renderers walk it and compute nothing."""

import enum
from collections.abc import Iterator
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

from srbval.report.blocks import Block, Figure, FigureGrid, Table, Tone, check_identifier


class Document(enum.StrEnum):
    """One of the two documents of a report; its value names the file."""

    MAIN = "report"
    APPENDIX = "appendix"


@dataclass(frozen=True, kw_only=True)
class VerdictBox:
    """The answer in plain words, first on the page: a tone, one sentence, a few points."""

    tone: Tone
    headline: str
    points: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Section:
    """One section; `id` is its anchor. `blocks` stand in the main document, those of `appendix` in the appendix."""

    id: str
    title: str
    blocks: tuple[Block, ...] = ()
    appendix: tuple[Block, ...] = ()

    def __post_init__(self) -> None:
        check_identifier(self.id, "section")

    @property
    def all_blocks(self) -> tuple[Block, ...]:
        """Those of both documents."""
        return (*self.blocks, *self.appendix)

    def part(self, document: Document) -> tuple[Block, ...]:
        """What of the section stands in a document."""
        return self.blocks if document is Document.MAIN else self.appendix


@dataclass(frozen=True, kw_only=True)
class Report:
    """A whole report: its main document and its appendix, which may be empty.

    `generated_utc` dates the page and the PDF (time zone required). `data` becomes ``report.json``; its
    ``figures`` list is filled from the tree. Raises ValueError when two parts share an id.
    """

    title: str
    generated_utc: datetime
    verdict: VerdictBox
    sections: tuple[Section, ...]
    subtitle: str = ""
    language: str = "en"
    data: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.generated_utc.utcoffset() is None:
            raise ValueError("generated_utc needs a time zone: use datetime.now(UTC).")
        seen: set[str] = set()
        for identifier in self._identifiers():
            if identifier in seen:
                raise ValueError(f"report id {identifier!r} is used twice.")
            seen.add(identifier)

    @property
    def generated_text(self) -> str:
        """Date and time of making, UTC, to the second."""
        return self.generated_utc.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")

    @property
    def has_appendix(self) -> bool:
        """Whether anything stands in the appendix."""
        return any(section.appendix for section in self.sections)

    def figures(self, document: Document | None = None) -> Iterator[Figure]:
        """The figures of a document, or of both, section by section, those in grids included."""
        for section in self.sections:
            for block in section.all_blocks if document is None else section.part(document):
                if isinstance(block, Figure):
                    yield block
                elif isinstance(block, FigureGrid):
                    yield from block.figures

    def tables(self) -> Iterator[Table]:
        """All tables of both documents, section by section."""
        for section in self.sections:
            yield from (block for block in section.all_blocks if isinstance(block, Table))

    def _identifiers(self) -> Iterator[str]:
        yield from ("verdict", "contents", "main")  # anchors of the page itself
        yield from (section.id for section in self.sections)
        yield from (table.id for table in self.tables())
        yield from (figure.id for figure in self.figures())
