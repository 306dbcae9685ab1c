"""Report sections that studies add: each is made from stored results and begins with their origin."""

import os
import platform
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from importlib import metadata
from typing import Any

from srbval import __version__
from srbval.models.run import Run
from srbval.processes.machine import processor_name
from srbval.report.blocks import Block, Callout, Paragraph, Section, Tone
from srbval.report.prose import Prose
from srbval.storage.installation import git_revision
from srbval.storage.stored_result import StoredResult, newest_result

STORED_TEXTS = Prose("srbval.report", "texts/stored.md")
PACKAGES = ("numpy", "scipy", "numba", "pandas", "PyWavelets", "h5py", "matplotlib")
StoredResults = Mapping[str, StoredResult]  # newest stored results of studies, by name


def stored_content(results: StoredResults, name: str) -> Mapping[str, Any]:
    """Return the content of the stored result `name`, or an empty mapping if there is none."""
    return results[name].content if name in results else {}


@dataclass(frozen=True)
class Page:
    """Section of the report on the newest stored result of the study in `package`; sections are sorted by `place`.

    `blocks` makes the section from the texts of the package (``texts.md``) and the content of the result, `tile` a
    short answer for the report's first screen. `data` computes further keys of ``report.json`` from the content and the
    loaded results; a list under an existing key extends that list. `more_results` names further results to load.
    """

    package: str
    place: float
    blocks: Callable[[Prose, Mapping[str, Any]], Iterable[Block]]
    data: Callable[[Mapping[str, Any], StoredResults], Mapping[str, Any]] = lambda *_: {}
    tile: Callable[[Prose, Mapping[str, Any]], Callout | None] = lambda *_: None
    more_results: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """Name of the study and of its result."""
        return self.package.rpartition(".")[2]

    def section(self, results: StoredResults) -> Section:
        """Make the section; it begins with the origin of the result or, without one, with the command to compute it."""
        prose = Prose(self.package)
        shown = self.blocks(prose, results[self.name].content) if self.name in results else ()
        return prose.section(origin_line(results, self.name), *shown)


def load_newest_results(pages: Iterable[Page], *names: str) -> StoredResults:
    """Load the newest stored results called `names`, and those from which `pages` are made."""
    wanted = dict.fromkeys((*names, *(name for page in pages for name in (page.name, *page.more_results))))
    return {name: result for name in wanted if (result := newest_result(name)) is not None}


def join_data(data: Mapping[str, Any], more: Iterable[Mapping[str, Any]]) -> dict[str, Any]:
    """Add further keys to `data`; lists under the same key are joined."""
    found = dict(data)
    for part in more:
        for key, value in part.items():
            found[key] = [*found[key], *value] if key in found and isinstance(value, list | tuple) else value
    return found


def origin_line(results: StoredResults, name: str) -> Callout | Paragraph:
    """State kind, date, machine and command of a stored result, and the reason if it is out of date.

    If no result is stored, the block names the command that computes it.
    """
    if name not in results:
        return STORED_TEXTS.callout("missing", tone=Tone.WARNING, command=f"srbval evidence {name}")
    result, origin = results[name], results[name].origin
    text = STORED_TEXTS.text(
        result.kind.value,
        made_utc=result.made_utc[:16].replace("T", " "),
        machine=origin.get("processor") or "an unknown processor",
        command=str(origin["command"] or "unknown command").replace("`", "'"),
    )
    why = result.why_stale()
    return Paragraph(text if why is None else f"{text} {STORED_TEXTS.text('stale', why=why)}")


def provenance(runs: Iterable[Run] = (), recordings: Mapping[str, str | None] | None = None) -> dict[str, Any]:
    """Return versions, computer and inputs of a report: random seeds of `runs`, SHA-256 of `recordings` by file."""
    return {
        "srbval": __version__,
        "git_revision": git_revision(),
        "python": platform.python_version(),
        "packages": {name: metadata.version(name) for name in PACKAGES},
        "machine": {"system": platform.system(), "processor": processor_name(), "cores": os.cpu_count()},
        "seeds": sorted({run.scene.seed for run in runs}),
        "recordings": recordings or {},
    }


def record_words(record: str) -> str:
    """Shorten the name of a rig record, such as OR_877rpm_sample to "OR 877"."""
    return record.removesuffix("_sample").removesuffix("rpm").replace("_", " ")
