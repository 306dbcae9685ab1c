"""Results of studies, which take minutes: JSON files that state their origin and what they depend on.

A result is the file ``NAME.json`` in the repository's ``reports`` or, newer, in the user's cache. It is one of three
kinds. *Evidence* can be computed from what the repository contains, and only evidence can be stale. A *recorded* result
rests on data sets that do not come with the program. A *document* belongs to one revision, as a prediction made before
a comparison does, and is never computed again.
"""

import enum
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.storage.behaviour import Fingerprint, differing, fingerprint_of, reference_fingerprint
from srbval.storage.cache import RESULTS, cache_folder
from srbval.storage.installation import package_folder, shipped_folder
from srbval.storage.json_files import read_json
from srbval.storage.sources import code_sha256

SCHEMA_VERSION = 3
MOST_BYTES = 2**26  # the longest there are have some megabytes
REPORTS = "reports"  # folder of the results that come with the program
DIRTY = "-dirty"  # end of the revision of a changed working tree


class ResultKind(enum.StrEnum):
    """Basis of a stored result, see the module."""

    EVIDENCE = "evidence"
    RECORDED = "recorded"
    DOCUMENT = "document"


@dataclass(frozen=True, kw_only=True)
class StoredResult:
    """A result file: its path and its content."""

    path: Path
    content: dict[str, Any]

    @property
    def made_utc(self) -> str:
        """When it was computed, ISO 8601."""
        return str(self.content["made_utc"])

    @property
    def kind(self) -> ResultKind:
        """Basis of the result."""
        if "computed_once" in self.content:
            return ResultKind.DOCUMENT
        return ResultKind(self.content.get("evidence_kind", ResultKind.EVIDENCE))

    @property
    def origin(self) -> dict[str, Any]:
        """Kind, date, revision, command, machine and duration, as the report states them."""
        stated = self.content | self.content.get("machine", {}) | {"kind": self.kind.value, "file": self.path.name}
        names = ("kind", "made_utc", "git_revision", "command", "processor", "usable_cores", "minutes", "file")
        return {name: stated.get(name) for name in names}

    def why_stale(self, now: Fingerprint | None = None) -> str | None:
        """Why it no longer holds for a program whose fingerprint is `now`, by default the reference; None if it holds.

        Evidence is stale if it was computed from a changed working tree, if its study does something else by now, or
        if a number differs in the fingerprint of a part on which it depends. Other kinds are never stale.
        """
        if self.kind is not ResultKind.EVIDENCE:
            return None
        revision, folder = self.content.get("git_revision"), package_folder() / "studies" / self.path.stem
        if isinstance(revision, str) and revision.endswith(DIRTY):
            return f"it was computed from a changed working tree, {revision}"
        if not (folder / "study.py").is_file():
            return f"no study is called {self.path.stem} any more"
        if code_sha256(folder) != self.content.get("code_sha256"):
            return f"the study {self.path.stem} computes something else by now"
        now = reference_fingerprint() if now is None else now
        try:
            then = fingerprint_of(self.content.get("fingerprint"))
        except ValueError:
            return "it does not state the fingerprint of the program that computed it"
        for part, numbers in then.items():
            if names := differing(numbers, now.get(part, {})):
                more = f" and {len(names) - 1} more" if len(names) > 1 else ""
                return f"the program's part {part} behaves differently: {names[0]}{more}"
        return None


def newest_result(name: str) -> StoredResult | None:
    """The newest result of this name in the user's cache, the repository or the installed package."""
    folders = (cache_folder(RESULTS), shipped_folder(REPORTS))
    found = [result for folder in folders if (result := read_result(folder / f"{name}.json")) is not None]
    return max(found, key=lambda result: result.made_utc, default=None)


def read_result(path: Path) -> StoredResult | None:
    """A result file; None if there is none, or none that this version can read."""
    try:
        content = read_json(path, MOST_BYTES)
    except DataError:
        return None
    fits = isinstance(content, dict) and content.get("kind") == path.stem
    fits = fits and content.get("schema_version") in (2, SCHEMA_VERSION)
    fits = fits and isinstance(content.get("made_utc"), str) and isinstance(content.get("machine", {}), dict)
    return StoredResult(path=path, content=content) if fits else None
