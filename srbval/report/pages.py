"""Pages that studies add to the report, each one section made of stored results and starting with their origin."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from srbval.report.blocks import Block, Callout, Paragraph, Section, Tone
from srbval.report.prose import Prose
from srbval.storage.stored_result import StoredResult, newest_result

STORED_TEXTS = Prose("srbval.report", "texts/stored.md")


class StoredResults(dict[str, StoredResult]):
    """The newest stored result of each name."""

    def content(self, name: str) -> Mapping[str, Any]:
        """Content of a result; empty without a result."""
        return self[name].content if name in self else {}


@dataclass(frozen=True, kw_only=True)
class Page:
    """A section of the report that is made of stored `results` alone; `place` orders the sections, see `assemble`.

    `data` gives further keys of ``report.json``; lists under a key that is already there are joined to it. `tile` is
    the short answer for the first screen, None without a result.
    """

    name: str
    place: float
    results: tuple[str, ...]
    section: Callable[[StoredResults], Section]
    data: Callable[[StoredResults], Mapping[str, Any]] = lambda _: {}
    tile: Callable[[StoredResults], Callout | None] = lambda _: None


def load_newest_results(pages: Iterable[Page], *names: str) -> StoredResults:
    """Newest results for `pages`, and for further `names`."""
    wanted = dict.fromkeys((*names, *(name for page in pages for name in page.results)))
    return StoredResults({name: result for name in wanted if (result := newest_result(name)) is not None})


def join_data(data: Mapping[str, Any], more: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
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
    tile: Callable[[Prose, Mapping[str, Any]], Callout] | None = None,
) -> Page:
    """Page of the study in `package`: its stored result's origin, then `blocks` of the folder's ``texts.md`` and it.

    Without a result the section names the command that computes it. `data` makes keys of ``report.json`` from it,
    `tile` its short answer on the first screen.
    """
    name, prose = package.rpartition(".")[2], Prose(package)

    def section(results: StoredResults) -> Section:
        shown = blocks(prose, results[name].content) if name in results else ()
        return prose.section(origin_line(results, name), *shown)

    def own_data(results: StoredResults) -> Mapping[str, Any]:
        return data(results[name].content) if name in results else {}

    def own_tile(results: StoredResults) -> Callout | None:
        return tile(prose, results[name].content) if tile and name in results else None

    return Page(name=name, place=place, results=(name,), section=section, data=own_data, tile=own_tile)


def origin_line(results: StoredResults, name: str) -> Block:
    """First line of a section that shows a stored result: its origin, or the command that computes it."""
    if name in results:
        return describe_origin(results[name])
    return STORED_TEXTS.callout("missing", tone=Tone.WARNING, command=f"srbval evidence {name}")


def describe_origin(result: StoredResult) -> Paragraph:
    """Origin of a stored result: kind, date, machine, command, data sets, and why it is stale."""
    origin, facts = result.origin, ("name", "records", "revision", "date")
    sets = [
        ", ".join(f"{one[fact]}{' records' * (fact == 'records')}" for fact in facts if one.get(fact))
        for one in result.content.get("data_sets", ())
    ]
    text = STORED_TEXTS.text(
        result.kind.value,
        made_utc=result.made_utc[:16].replace("T", " "),
        machine=origin.get("processor") or "an unknown processor",
        command=str(origin["command"] or "unknown command").replace("`", "'"),
        data_sets="; ".join(sets) or "not stated",
    )
    why = result.why_stale()
    return Paragraph(text if why is None else f"{text} {STORED_TEXTS.text('stale', why=why)}")
