"""Results of studies, which take minutes: JSON files that state their origin and what they depend on.

A result is the file ``NAME.json`` in the repository's ``reports`` or, newer, in the user's cache. It is one of three
kinds. *Evidence* can be computed from what the repository contains, and only evidence can be stale. A *recorded* result
rests on data sets that do not come with the program. A *document* belongs to one revision, as a prediction made before
a comparison does, and is never computed again.

Evidence depends on the program's behaviour, of which a fingerprint has, for each part of the program, numbers and words
by name; `srbval.check.check` computes one, and the reference fingerprint comes with the program.
"""

import enum
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from srbval.errors import DataError
from srbval.storage.cache import STUDY_RESULTS, cache_folder
from srbval.storage.installation import package_folder, shipped_folder
from srbval.storage.json_files import read_json
from srbval.storage.sources import code_sha256

FingerprintValue = float | str
PartFingerprint = Mapping[str, FingerprintValue]
Fingerprint = Mapping[str, PartFingerprint]

RESULT_SCHEMA_VERSION = 3
MAX_RESULT_BYTES = 2**26  # the longest there are have some megabytes
REPORTS = "reports"  # folder of the results that come with the program
REFERENCE, REFERENCE_ORIGIN = "fingerprint.json", {"schema_version": 1, "kind": "fingerprint"}
DIRTY = "-dirty"  # end of the revision of a changed working tree
# Rounding that differs between processors and versions of libraries reaches 1e-8 in the probes; a change of 1e-6 is a
# thousandth of what any published number states.
RELATIVE_TOLERANCE = 1e-6
# Least difference that matters, by the unit that ends a name; smaller values are rounding of a theoretical zero.
MIN_DIFFERENCE = {"m_s2": 1e-5, "w": 1e-3, "m": 1e-12, "db": 1e-4, "p": 1e-6}


def tolerance(name: str, value: float) -> float:
    """Largest difference from `value` at which a number of this name counts as equal; 0 if it is not finite."""
    if not math.isfinite(value):
        return 0.0
    return max(
        RELATIVE_TOLERANCE * abs(value),
        next((least for unit, least in MIN_DIFFERENCE.items() if name.endswith(f"_{unit}")), 0.0),
    )


@dataclass(frozen=True, kw_only=True)
class CheckedQuantity:
    """One number of the fingerprint: its `value` now and the range that it must lie in.

    A word is stated by `words`, its reference and its value now; its `value` is then 1 if both are the same, else 0.
    `low` and `high` are NaN for a number that the reference does not have, `value` for one that is not computed.
    """

    name: str
    value: float
    low: float
    high: float
    ok: bool
    unit: str = ""
    words: tuple[str, str] | None = None


def compare_part(now: PartFingerprint, known: PartFingerprint) -> list[CheckedQuantity]:
    """Every number and word of a part against its reference, those that only one of them has at the end, which fail.

    NaN agrees with NaN, a word with the same word.
    """
    found, both = [], [name for name in now if name in known]
    for name in dict.fromkeys([*both, *now, *known]):
        value, middle, words = now.get(name, math.nan), known.get(name, math.nan), None
        if isinstance(value, str) or isinstance(middle, str):
            words, value, middle = (str(middle), str(value)), float(value == middle), 1.0
        near = 0.0 if words else tolerance(name, middle)
        equal = value == middle or abs(value - middle) <= near or (math.isnan(value) and math.isnan(middle))
        ok, low, high = equal and name in both, middle - near, middle + near
        found.append(CheckedQuantity(name=name, value=value, low=low, high=high, ok=ok, words=words))
    return found


def fingerprint_of(table: Any) -> dict[str, dict[str, FingerprintValue]]:
    """The fingerprint in a JSON document, in which null stands for NaN; `ValueError` if it is none."""
    if not isinstance(table, Mapping) or not all(isinstance(values, Mapping) for values in table.values()):
        raise ValueError("no fingerprint: not a table of tables")
    return {
        part: {name: math.nan if value is None else value for name, value in values.items()}
        for part, values in table.items()
    }


@cache
def reference_fingerprint() -> Fingerprint:
    """The fingerprint that comes with the program, with which `srbval check` compares it; empty if there is none."""
    try:
        content = read_json(shipped_folder(REPORTS) / REFERENCE, MAX_RESULT_BYTES)
        known = all(content[key] == value for key, value in REFERENCE_ORIGIN.items())
        return fingerprint_of(content["parts"]) if known else {}
    except (DataError, LookupError, TypeError, ValueError):
        return {}


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
            if names := [one.name for one in compare_part(now.get(part, {}), numbers) if not one.ok]:
                more = f" and {len(names) - 1} more" if len(names) > 1 else ""
                return f"the program's part {part} behaves differently: {names[0]}{more}"
        return None


def newest_result(name: str) -> StoredResult | None:
    """The newest result of this name in the user's cache, the repository or the installed package."""
    folders = (cache_folder(STUDY_RESULTS), shipped_folder(REPORTS))
    found = [result for folder in folders if (result := read_result(folder / f"{name}.json")) is not None]
    return max(found, key=lambda result: result.made_utc, default=None)


def read_result(path: Path) -> StoredResult | None:
    """A result file; None if there is none, or none that this version can read."""
    try:
        content = read_json(path, MAX_RESULT_BYTES)
    except DataError:
        return None
    fits = isinstance(content, dict) and content.get("kind") == path.stem
    fits = fits and content.get("schema_version") in (2, RESULT_SCHEMA_VERSION)
    fits = fits and isinstance(content.get("made_utc"), str) and isinstance(content.get("machine", {}), dict)
    return StoredResult(path=path, content=content) if fits else None
