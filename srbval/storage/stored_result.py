"""Results of studies, which take minutes or hours: JSON files that say what they depend on.

A study's result is the file ``NAME.json``, in the repository's ``reports`` or, newer, in the user's cache. It says on
which machine it was made, when, from which revision, by which command, and by which sources from which data.
"""

import re
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.storage.cache import RESULTS, cache_folder
from srbval.storage.files import file_sha256
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import read_json
from srbval.storage.sources import sources_sha256

SCHEMA_VERSION = 2
MOST_BYTES = 2**26  # the longest there are have some megabytes
REPORTS = "reports"  # folder of the results that come with the program
DIRTY = "-dirty"  # end of the revision of a changed working tree
SHIPPED_INPUT = re.compile(r"(reports|data_manifest)/[\w./-]+")


@dataclass(frozen=True, kw_only=True)
class StoredResult:
    """A result file: where it lies and what is in it."""

    path: Path
    content: dict[str, Any]

    @property
    def made_utc(self) -> str:
        """When it was made, ISO 8601."""
        return str(self.content["made_utc"])

    @property
    def origin(self) -> dict[str, Any]:
        """Date, revision, command and machine, as the report states them."""
        machine = self.content.get("machine", {})
        return {
            "made_utc": self.made_utc,
            "git_revision": self.content.get("git_revision"),
            "command": self.content.get("command"),
            "processor": machine.get("processor"),
            "usable_cores": machine.get("usable_cores"),
            "file": self.path.name,
        }

    @cached_property
    def stale(self) -> str | None:
        """Why the result no longer holds, as far as the program alone can tell; None where it does.

        Inputs that come with the program (``reports/...``, ``data_manifest/...``) are compared with the files, others
        are taken for unchanged. A result that says why it is `computed_once`, a prediction before a comparison or its
        outcome, is a document of its revision: later sources do not change it, and what they would compute of records
        that are known by now is not that test.
        """
        stated = self.content.get
        revision, module, known = stated("git_revision"), stated("computed_by"), stated("inputs_sha256")
        if isinstance(revision, str) and revision.endswith(DIRTY):
            return f"it was computed from a changed working tree, {revision}"
        if not stated("computed_once"):
            if not (isinstance(module, str) and isinstance(known, dict) and isinstance(stated("sources_sha256"), str)):
                return "it does not say by which sources it was computed"
            try:
                if sources_sha256(module) != stated("sources_sha256"):
                    return f"the sources of {module} have changed since"
            except ModuleNotFoundError:
                return f"the module that computed it, {module}, is no more"
        inputs = known if isinstance(known, dict) else {}
        changed = [name for name in inputs if SHIPPED_INPUT.fullmatch(name) and _shipped_sha256(name) != inputs[name]]
        return f"its input {changed[0]} has changed since" if changed else None


def newest_result(name: str) -> StoredResult | None:
    """The newest result of this name in the user's cache, the repository or the installed package."""
    folders = (cache_folder(RESULTS), shipped_folder(REPORTS))
    found = [result for folder in folders if (result := _read(folder / f"{name}.json", name)) is not None]
    return max(found, key=lambda result: result.made_utc, default=None)


def _shipped_sha256(name: str) -> str:
    folder, _, rest = name.partition("/")
    try:
        return file_sha256(shipped_folder(folder) / rest)
    except DataError:
        return ""


def _read(path: Path, name: str) -> StoredResult | None:
    """A result file; None where there is none, or none that this version can read."""
    try:
        content = read_json(path, MOST_BYTES)
    except DataError:
        return None
    fits = isinstance(content, dict) and content.get("kind") == name and content.get("schema_version") == SCHEMA_VERSION
    fits = fits and isinstance(content.get("made_utc"), str) and isinstance(content.get("machine", {}), dict)
    return StoredResult(path=path, content=content) if fits else None
