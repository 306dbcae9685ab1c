"""Recompute everything and compare it with the reference results; replace these by the new ones.

A reference has a value for every quantity, how far a new one may be from it, and why that far.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from srbval import __version__
from srbval.check.quantities import GROUPS
from srbval.errors import ConfigurationError, DataError
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene
from srbval.storage.installation import git_revision, shipped_folder
from srbval.storage.json_files import read_json, write_json
from srbval.storage.stored_result import MOST_BYTES, REPORTS, StoredResult
from srbval.storage.tables import build

FILE = "reference.json"
KIND, SCHEMA_VERSION = "reference", 1
SPARE_DIGITS = 2  # of a value beyond its tolerance's first


@dataclass(frozen=True, kw_only=True)
class ReferenceQuantity:
    """One quantity: `value` [`unit`], None where not yet known, the `tolerance` either side and the `reason` for it."""

    name: str
    value: float | None = None
    tolerance: float
    unit: str
    reason: str

    def __post_init__(self) -> None:
        if not (math.isfinite(self.tolerance) and self.tolerance >= 0):
            raise ConfigurationError(f"{self.name}: tolerance = {self.tolerance} must be zero or a positive number.")
        if not self.reason.strip():
            raise ConfigurationError(f"{self.name}: a tolerance needs its reason; write one.")

    def at(self, value: float) -> ReferenceQuantity:
        """The same quantity with `value` for reference, to two digits more than the tolerance has."""
        if not self.tolerance:
            return replace(self, value=value)
        return replace(self, value=round(value, SPARE_DIGITS - math.floor(math.log10(self.tolerance))))


def reference_path() -> Path:
    """The reference results of this version: in the repository, or in the installed package."""
    return shipped_folder("reports") / FILE


def read_reference(path: Path) -> dict[str, ReferenceQuantity]:
    """The quantities of a reference file by name; `DataError` where it cannot be read or understood."""
    content = read_json(path)
    if not isinstance(content, dict) or (content.get("kind"), content.get("schema_version")) != (KIND, SCHEMA_VERSION):
        raise DataError(f"{path}: not a reference file of version {SCHEMA_VERSION}.")
    tables = content.get("quantities", [])
    if not isinstance(tables, list) or not tables:
        raise DataError(f"{path}: its quantities are not a list, or an empty one.")
    listed = [build(ReferenceQuantity, table, f"{path.name}[{i}]", stored=True) for i, table in enumerate(tables)]
    quantities = {q.name: q for q in listed}
    if len(quantities) != len(listed):
        raise DataError(f"{path}: a quantity is named twice.")
    return quantities


def write_reference(path: Path, quantities: Mapping[str, ReferenceQuantity]) -> None:
    """Write `path` completely or not at all."""
    origin = {"schema_version": SCHEMA_VERSION, "kind": KIND, "srbval": __version__, "git_revision": git_revision()}
    write_json(path, origin | {"quantities": [asdict(quantity) for quantity in quantities.values()]})


@dataclass(frozen=True, kw_only=True)
class CheckedQuantity:
    """One quantity: its fresh `value` and the range it must lie in, all in `unit`.

    `value` is NaN where it could not be computed; `low` and `high` are NaN where there is no reference yet.
    """

    JSON_PROPERTIES: ClassVar = ("ok",)

    name: str
    value: float
    low: float
    high: float
    unit: str
    reason: str

    @property
    def ok(self) -> bool:
        """Is the value within the range? Never so where either is missing."""
        return self.low <= self.value <= self.high


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """All quantities checked; `skipped` names those that need a recording which is not registered.

    `stale` are files in ``reports`` that no longer hold: `file` and `why`. They are no failure.
    """

    JSON_PROPERTIES: ClassVar = ("ok",)

    checks: tuple[CheckedQuantity, ...]
    skipped: tuple[str, ...]
    stale: tuple[Mapping[str, str], ...] = ()

    @property
    def ok(self) -> bool:
        """Is every quantity within its range?"""
        return all(check.ok for check in self.checks)


def run_check(
    reference: Mapping[str, ReferenceQuantity] | None = None,
    *,
    base: Scene | None = None,
    groups: Collection[str] | None = None,
    progress: Progress = silent,
) -> CheckResult:
    """Compute the quantities of `groups` (all) from the scene `base` (the paper's), compare each with its reference.

    `reference` defaults to this version's own, see `reference_path`.

    With all groups, a quantity of the reference that is no longer computed fails. Raises `ConfigurationError` for an
    unknown group, and what loading a damaged recording raises; a run that fails is a result.
    """
    known = read_reference(reference_path()) if reference is None else reference
    wanted = set(GROUPS if groups is None else groups)
    if unknown := wanted - set(GROUPS):
        raise ConfigurationError(f"group {min(unknown)!r} is not known. Known: {', '.join(GROUPS)}.")
    fresh: dict[str, float | None] = {}
    for name in (name for name in GROUPS if name in wanted):
        progress(name, 0.0)
        fresh |= GROUPS[name](base or paper_scene(), progress)
        progress(name, 1.0)
    if wanted == set(GROUPS):
        fresh |= {name: math.nan for name in known if name not in fresh}
    return CheckResult(
        checks=tuple(_checked(name, value, known.get(name)) for name, value in fresh.items() if value is not None),
        skipped=tuple(name for name, value in fresh.items() if value is None),
        stale=stale_reports(),
    )


def stale_reports() -> tuple[Mapping[str, str], ...]:
    """Stored results of studies in ``reports`` whose sources or inputs have changed since: `file` and `why`."""
    found = []
    for path in sorted(shipped_folder(REPORTS).glob("*.json")):
        content = {} if path.name == FILE else read_json(path, MOST_BYTES)
        why = StoredResult(path=path, content=content).stale if content.get("kind") == path.stem else None
        if why is not None:
            found.append({"file": path.name, "why": why})
    return tuple(found)


def _checked(name: str, value: float, wanted: ReferenceQuantity | None) -> CheckedQuantity:
    if wanted is None:
        none = "no reference: give it a tolerance and a reason in the reference file"
        return CheckedQuantity(name=name, value=value, low=math.nan, high=math.nan, unit="", reason=none)
    middle = math.nan if wanted.value is None else wanted.value
    return CheckedQuantity(
        name=name, value=value, low=middle - wanted.tolerance, high=middle + wanted.tolerance, unit=wanted.unit,
        reason=wanted.reason,
    )  # fmt: skip


def renewed(reference: Mapping[str, ReferenceQuantity], result: CheckResult) -> dict[str, ReferenceQuantity]:
    """The reference with the fresh values of `result`; tolerances and reasons stay, and so does what was skipped.

    Raises `ConfigurationError` for a quantity that could not be computed (no reference may be made of a failure) or
    that has neither tolerance nor reason yet.
    """
    for check in result.checks:
        if not math.isfinite(check.value):
            raise ConfigurationError(f"{check.name} could not be computed; nothing was replaced. Correct that first.")
        if check.name not in reference:
            raise ConfigurationError(f"{check.name} has no tolerance and no reason; add both to the reference file.")
    fresh = {check.name: check.value for check in result.checks}
    return {name: old.at(fresh[name]) if name in fresh else old for name, old in reference.items()}


def differences(old: Mapping[str, ReferenceQuantity], new: Mapping[str, ReferenceQuantity]) -> list[dict[str, Any]]:
    """What an update would change: name, old and new value, unit, and how far it `moved` in tolerances.

    `moved` is None without an old value or a tolerance.
    """
    found = []
    for name, quantity in new.items():
        before, after = old[name].value, quantity.value
        if after != before:
            moved = None
            if before is not None and after is not None and quantity.tolerance:
                moved = (after - before) / quantity.tolerance
            found.append({"name": name, "old": before, "new": after, "unit": quantity.unit, "moved": moved})
    return found
