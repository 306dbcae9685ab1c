"""Report sections that studies add: each is made from stored results and begins with their origin."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from srbval.report.blocks import Block, Callout, Paragraph, Section, Tone
from srbval.report.prose import Prose
from srbval.storage.stored_result import StoredResult, newest_result

STORED_TEXTS = Prose("srbval.report", "texts/stored.md")
StoredResults = Mapping[str, StoredResult]  # newest stored results of studies, by name


def stored_content(results: StoredResults, name: str) -> Mapping[str, Any]:
    """Return the content of the stored result `name`, or an empty mapping if there is none."""
    return results[name].content if name in results else {}


@dataclass(frozen=True, kw_only=True)
class Page:
    """Section of the report, made from the stored results named in `results`; sections are sorted by `place`.

    `data` returns further keys of ``report.json``; a list under an existing key extends the list that is there. `tile`
    returns a short answer for the report's first screen, or None if no result is stored.
    """

    name: str
    place: float
    results: tuple[str, ...]
    section: Callable[[StoredResults], Section]
    data: Callable[[StoredResults], Mapping[str, Any]]
    tile: Callable[[StoredResults], Callout | None]


def load_newest_results(pages: Iterable[Page], *names: str) -> StoredResults:
    """Load the newest stored results of `names` and of the names that `pages` use."""
    wanted = dict.fromkeys((*names, *(name for page in pages for name in page.results)))
    return {name: result for name in wanted if (result := newest_result(name)) is not None}


def join_data(data: Mapping[str, Any], more: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Add further keys to `data`; lists under the same key are joined."""
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
    """Make the page of the study in `package` from its newest stored result.

    The section starts with the origin of the result, followed by `blocks`, made from the result and the package's
    ``texts.md``. Without a result the section names the command that computes it. `data` and `tile` compute keys of
    ``report.json`` and the short answer on the first screen from the result.
    """
    name, prose = package.rpartition(".")[2], Prose(package)

    def section(results: StoredResults) -> Section:
        shown = blocks(prose, results[name].content) if name in results else ()
        return prose.section(origin_line(results, name), *shown)

    return Page(
        name=name,
        place=place,
        results=(name,),
        section=section,
        data=lambda results: data(results[name].content) if name in results else {},
        tile=lambda results: tile(prose, results[name].content) if tile and name in results else None,
    )


def origin_line(results: StoredResults, name: str) -> Callout | Paragraph:
    """State kind, date, machine, command and data sets of a stored result, and the reason if it is out of date.

    If no result is stored, the block names the command that computes it.
    """
    if name not in results:
        return STORED_TEXTS.callout("missing", tone=Tone.WARNING, command=f"srbval evidence {name}")
    result, facts = results[name], ("name", "records", "revision", "date")
    origin = result.origin
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


def record_words(record: str) -> str:
    """Shorten the name of a rig record, such as OR_877rpm_sample to "OR 877"."""
    return record.removesuffix("_sample").removesuffix("rpm").replace("_", " ")
