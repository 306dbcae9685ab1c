"""What stored results add to the report: pages, which studies bring along and the report only arranges."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import groupby
from typing import Any

from srbval.report.blocks import Section
from srbval.storage.stored_result import StoredResult, newest_result


class StoredResults(dict[str, StoredResult]):
    """The newest stored result of each name."""

    def content(self, name: str) -> Mapping[str, Any]:
        """The content of a result; empty where there is none."""
        return self[name].content if name in self else {}


@dataclass(frozen=True, kw_only=True)
class Page:
    """A section of the report that is made of stored `results` alone.

    `place` orders the sections, see `assemble`; pages whose sections have one id follow each other within one section.
    `data` gives further keys of ``report.json``, of which lists are joined to those of the same key.
    """

    name: str
    place: float
    results: tuple[str, ...]
    section: Callable[[StoredResults], Section]
    data: Callable[[StoredResults], Mapping[str, Any]] = lambda _: {}


def results_of(pages: Iterable[Page], *names: str) -> StoredResults:
    """The newest results that `pages` are made of, and those of further `names`."""
    wanted = dict.fromkeys((*names, *(name for page in pages for name in page.results)))
    return StoredResults({name: result for name in wanted if (result := newest_result(name)) is not None})


def in_order(placed: Iterable[tuple[float, Section]]) -> tuple[Section, ...]:
    """Sections by their place; those of one id, one after another, as one with the first one's title."""
    ordered = [section for _, section in sorted(placed, key=lambda one: one[0])]
    return tuple(_joined(list(same)) for _, same in groupby(ordered, key=lambda section: section.id))


def _joined(sections: list[Section]) -> Section:
    return replace(
        sections[0],
        blocks=tuple(block for section in sections for block in section.blocks),
        appendix=tuple(block for section in sections for block in section.appendix),
    )


def joined_data(data: Mapping[str, Any], more: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """`data` with further keys; lists under the same key are joined."""
    found = dict(data)
    for part in more:
        for key, value in part.items():
            found[key] = [*found[key], *value] if key in found and isinstance(value, list | tuple) else value
    return found
