"""What pages of studies say of the results they show; the page that shows one in the report's appendix."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

from srbval.report.blocks import Block, Callout, Paragraph, Section, Tone
from srbval.report.pages import Page, StoredResults
from srbval.report.section_texts import Texts, expressions
from srbval.storage.stored_result import StoredResult

STORED = Texts("stored", "srbval.studies", "")


def appendix_page(
    package: str,
    place: float,
    blocks: Callable[[Texts, Mapping[str, Any]], Iterable[Block]],
    data: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda _: {},
) -> Page:
    """The page of the study in `package`: where its result comes from, and `blocks` of its texts and the content.

    Without a result, which command makes it. `data` are keys of ``report.json``, of the content, empty without one.
    """
    name, texts = package.rpartition(".")[2], Texts.of_study(package)

    def section(results: StoredResults) -> Section:
        result = results.get(name)
        shown = [missing(name)] if result is None else [origin_of(result), *blocks(texts, result.content)]
        return texts.section(appendix=shown)

    return Page(
        name=name, place=place, results=(name,), section=section, data=lambda results: data(results.content(name))
    )


def page_of_texts(package: str) -> Page:
    """The page that the entry ``[page]`` of a study's ``texts.toml`` describes: its place, its blocks, its data."""
    texts = Texts.of_study(package)
    data = texts.page.get("data", {})
    return appendix_page(
        package, texts.page["place"], lambda texts, content: texts.blocks(content=content),
        data=lambda content: expressions(data, {"content": content}) if content else {key: [] for key in data},
    )  # fmt: skip


def origin_of(result: StoredResult) -> Paragraph:
    """Machine, date, revision and command of a stored result, and whether it is stale."""
    return STORED.paragraph("origin", origin=result.origin, stale=result.stale)


def missing(name: str) -> Callout:
    """What stands in place of a result that is not there."""
    return STORED.callout("missing", tone=Tone.WARNING, command=f"srbval study run {name}")
