"""Pages that studies add to the report, made of stored results.

A page is one section. Its first line states the origin of its result, or which command computes it.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from srbval.report.blocks import Block, Callout, Paragraph, Section, Tone
from srbval.report.prose import Prose
from srbval.storage.stored_result import StoredResult, newest_result

STORED = Prose("srbval.report", "texts/stored.md")


class StoredResults(dict[str, StoredResult]):
    """The newest stored result of each name."""

    def content(self, name: str) -> Mapping[str, Any]:
        """Content of a result; empty without a result."""
        return self[name].content if name in self else {}


@dataclass(frozen=True, kw_only=True)
class Page:
    """A section of the report that is made of stored `results` alone.

    `place` orders the sections, see `assemble`.
    `data` gives further keys of ``report.json``; lists under a key that is already there are joined to it.
    """

    name: str
    place: float
    results: tuple[str, ...]
    section: Callable[[StoredResults], Section]
    data: Callable[[StoredResults], Mapping[str, Any]] = lambda _: {}


def results_of(pages: Iterable[Page], *names: str) -> StoredResults:
    """Newest results for `pages`, and for further `names`."""
    wanted = dict.fromkeys((*names, *(name for page in pages for name in page.results)))
    return StoredResults({name: result for name in wanted if (result := newest_result(name)) is not None})


def joined_data(data: Mapping[str, Any], more: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """`data` with further keys; lists under the same key are joined."""
    found = dict(data)
    for part in more:
        for key, value in part.items():
            found[key] = [*found[key], *value] if key in found and isinstance(value, list | tuple) else value
    return found


def study_page(
    package: str,
    place: float,
    blocks: Callable[[Prose, Mapping[str, Any]], Iterable[Block]],
    data: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda _: {},
) -> Page:
    """Page of the study in `package`, of its stored result of the same name and the file ``texts.md`` in its folder.

    Its section starts with the origin of the result; `blocks` makes the rest from the texts and the content. Without a
    result the section names the command that makes it. `data` makes keys of ``report.json`` from the content.
    """
    name, prose = package.rpartition(".")[2], Prose(package)

    def section(results: StoredResults) -> Section:
        shown = blocks(prose, results[name].content) if name in results else ()
        return prose.section(first_line(results, name), *shown)

    def own_data(results: StoredResults) -> Mapping[str, Any]:
        return data(results[name].content) if name in results else {}

    return Page(name=name, place=place, results=(name,), section=section, data=own_data)


def first_line(results: StoredResults, name: str) -> Block:
    """First line of a section that shows a stored result: its origin, or the command that computes it."""
    return origin_of(results[name]) if name in results else missing(name)


def origin_of(result: StoredResult) -> Paragraph:
    """Kind, date, machine, revision and command of a stored result, and why it is stale if it is.

    The kinds: *evidence* follows from what the repository contains, *recorded* also needs data sets that do not ship
    (``data_sets`` of its content: name, records, revision, date), a *document* belongs to one revision.
    """
    origin = result.origin
    text = STORED.text(
        result.kind.value,
        made_utc=result.made_utc,
        machine=_machine(origin),
        revision=origin["git_revision"] or "unknown (installed copy)",
        command=str(origin["command"] or "unknown command").replace("`", "'"),
        data_sets=data_sets_of(result.content),
    )
    return Paragraph(text if result.stale is None else f"{text} {STORED.text('stale', why=result.stale)}")


def data_sets_of(content: Mapping[str, Any]) -> str:
    """The data sets that a recorded result was computed on, in words."""
    facts = [
        (one["name"], one.get("records") and f"{one['records']} records", one.get("revision"), one.get("date"))
        for one in content.get("data_sets", ())
    ]
    return "; ".join(", ".join(str(fact) for fact in one if fact) for one in facts) or "not stated"


def _machine(origin: Mapping[str, Any]) -> str:
    cores = origin.get("usable_cores")
    return f"{origin.get('processor') or 'an unknown processor'}{f' ({cores} usable cores)' if cores else ''}"


def missing(name: str) -> Callout:
    """Callout in place of a result that is not stored."""
    return STORED.callout("missing", tone=Tone.WARNING, command=f"srbval evidence {name}")
