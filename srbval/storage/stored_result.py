"""Stored results of studies: JSON files with their origin and dependencies.

A result is the file ``NAME.json`` in the repository's ``reports`` or, if newer, in the user's cache. There are three
kinds. *Evidence* can be computed from the content of the repository, and only evidence can become stale. A *recorded*
result needs data sets that are not shipped with srbval. A *document* belongs to one revision, like a prediction made
before a comparison, and is never computed again.

Evidence depends on the program's behaviour. A fingerprint describes the behaviour by numbers and words for each part of
the program; `srbval.check` computes a fingerprint, and the reference fingerprint is shipped with srbval.
"""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.storage.installation import STUDY_RESULTS, cache_folder, package_folder, shipped_folder
from srbval.storage.json_files import read_json
from srbval.storage.sources import code_sha256

FingerprintValue = float | str
PartFingerprint = Mapping[str, FingerprintValue]
Fingerprint = Mapping[str, PartFingerprint]

RESULT_SCHEMA_VERSION = 3
MAX_RESULT_BYTES = 2**26  # the largest results have some megabytes
REPORTS = "reports"  # folder of the results that come with the program
REFERENCE_FILE, REFERENCE_ORIGIN = "fingerprint.json", {"schema_version": 1, "kind": "fingerprint"}
DIRTY = "-dirty"  # suffix of the revision of a changed working tree
# Rounding that differs between processors and versions of libraries reaches 1e-8 in the probes; a change of 1e-6 is a
# thousandth of what any published number states.
RELATIVE_TOLERANCE = 1e-6
# Smallest relevant difference by the unit at the end of a name; below it, values are rounding errors of zero.
MIN_DIFFERENCE = {"m_s2": 1e-5, "w": 1e-3, "m": 1e-12, "db": 1e-4, "p": 1e-6}


def compare_part(now: PartFingerprint, known: PartFingerprint) -> list[dict[str, Any]]:
    """Compare a program part's fingerprint `now` with the reference `known`; a number missing in one of them fails.

    Each row has a `name`, the present `value` (NaN if none), the accepted range `low` to `high` (NaN if the reference
    lacks the number) and `ok`. For words, such as a status, `words` are the reference word and the present word, and
    `value` is 1 if they are equal, otherwise 0. `unit` is empty.
    """
    found, both = [], [name for name in now if name in known]
    for name in dict.fromkeys([*both, *now, *known]):
        value, middle, words = now.get(name, math.nan), known.get(name, math.nan), None
        if isinstance(value, str) or isinstance(middle, str):
            words, value, middle = (str(middle), str(value)), float(value == middle), 1.0
        smallest = next((size for unit, size in MIN_DIFFERENCE.items() if name.endswith(f"_{unit}")), 0.0)
        near = 0.0 if words or not math.isfinite(middle) else max(RELATIVE_TOLERANCE * abs(middle), smallest)
        equal = value == middle or abs(value - middle) <= near or (math.isnan(value) and math.isnan(middle))
        row = {"name": name, "value": value, "low": middle - near, "high": middle + near}
        found.append(row | {"ok": equal and name in both, "unit": "", "words": words})
    return found


def fingerprint_of(table: Mapping[str, Any]) -> dict[str, dict[str, FingerprintValue]]:
    """Read program parts' behaviour from JSON, {part: {name: value or null for NaN}}."""
    return {
        part: {name: math.nan if value is None else value for name, value in values.items()}
        for part, values in table.items()
    }


@cache
def reference_fingerprint() -> Fingerprint:
    """Load the shipped numbers that describe the behaviour of each program part."""
    return fingerprint_of(read_json(shipped_folder(REPORTS) / REFERENCE_FILE, MAX_RESULT_BYTES)["parts"])


class ResultKind(enum.StrEnum):
    """Kind of a result: `EVIDENCE` (reproducible), `RECORDED` (from data not shipped), `DOCUMENT` (made once)."""

    EVIDENCE = "evidence"
    RECORDED = "recorded"
    DOCUMENT = "document"


@dataclass(frozen=True, kw_only=True)
class StoredResult:
    """Stored result of a study: the path and the content of its JSON file."""

    path: Path
    content: dict[str, Any]

    @property
    def made_utc(self) -> str:
        """Date and time at which the result was computed, ISO 8601."""
        return str(self.content["made_utc"])

    @property
    def kind(self) -> ResultKind:
        """Kind of the result: evidence (reproducible), recorded (needs data not shipped) or document (made once)."""
        if "computed_once" in self.content:
            return ResultKind.DOCUMENT
        return ResultKind(self.content.get("evidence_kind", ResultKind.EVIDENCE))

    @property
    def origin(self) -> dict[str, Any]:
        """Origin of the result for the report: kind, date, revision, command, machine, duration and file name."""
        stated = self.content | self.content.get("machine", {}) | {"kind": self.kind.value, "file": self.path.name}
        names = ("kind", "made_utc", "git_revision", "command", "processor", "usable_cores", "minutes", "file")
        return {name: stated.get(name) for name in names}

    def why_stale(self, now: Fingerprint | None = None) -> str | None:
        """Reason why the result is out of date, by the fingerprint `now` (default: the reference); None if it is valid.

        Evidence is stale if it was computed from a working tree with uncommitted changes, if its study has been changed
        since, or if the fingerprint of a program part on which it depends has changed. Other kinds are never stale.
        """
        if self.kind is not ResultKind.EVIDENCE:
            return None
        revision, folder = self.content.get("git_revision"), package_folder() / "studies" / self.path.stem
        if isinstance(revision, str) and revision.endswith(DIRTY):
            return f"it was computed from a changed working tree, {revision}"
        if not (folder / "study.py").is_file():
            return f"there is no study {self.path.stem} any more"
        if code_sha256(folder) != self.content.get("code_sha256"):
            return f"the code of the study {self.path.stem} has changed"
        now = reference_fingerprint() if now is None else now
        then = self.content.get("fingerprint")
        if then is None:
            return "it does not state the fingerprint of the program that computed it"
        for part, numbers in fingerprint_of(then).items():
            if names := [one["name"] for one in compare_part(now.get(part, {}), numbers) if not one["ok"]]:
                more = f" and {len(names) - 1} more" if len(names) > 1 else ""
                return f"the program's part {part} behaves differently: {names[0]}{more}"
        return None


def newest_result(name: str) -> StoredResult | None:
    """Load the newest result `name` from the user's cache or the shipped reports; None if there is none."""
    folders = (cache_folder(STUDY_RESULTS), shipped_folder(REPORTS))
    found = [result for folder in folders if (result := read_result(folder / f"{name}.json")) is not None]
    return max(found, key=lambda result: result.made_utc, default=None)


def read_result(path: Path) -> StoredResult | None:
    """Read a stored result; None if the file is missing, damaged or in another format version."""
    try:
        content = read_json(path, MAX_RESULT_BYTES)
    except DataError:
        return None
    fits = isinstance(content, dict) and content.get("kind") == path.stem
    fits = fits and content.get("schema_version") in (2, RESULT_SCHEMA_VERSION)
    fits = fits and isinstance(content.get("made_utc"), str) and isinstance(content.get("machine", {}), dict)
    return StoredResult(path=path, content=content) if fits else None
