"""Recompute everything and compare it with the reference results; replace these by the new ones."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar
from xml.etree import ElementTree

from srbval.check.quantities import GROUPS
from srbval.check.reference import ReferenceQuantity, read_reference, reference_path
from srbval.errors import ConfigurationError
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene
from srbval.storage.files import atomic_write


@dataclass(frozen=True, kw_only=True)
class Checked:
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
    """All quantities checked; `skipped` names those that need a recording which is not registered."""

    JSON_PROPERTIES: ClassVar = ("ok",)

    checks: tuple[Checked, ...]
    skipped: tuple[str, ...]

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
    unknown = wanted - set(GROUPS)
    if unknown:
        raise ConfigurationError(f"group {min(unknown)!r} is not known. Known: {', '.join(GROUPS)}.")
    start = base if base is not None else paper_scene()
    fresh: dict[str, float | None] = {}
    for name in (name for name in GROUPS if name in wanted):
        progress(name, 0.0)
        fresh |= GROUPS[name](start, progress)
        progress(name, 1.0)
    if wanted == set(GROUPS):
        fresh |= {name: math.nan for name in known if name not in fresh}
    return CheckResult(
        checks=tuple(_checked(name, value, known.get(name)) for name, value in fresh.items() if value is not None),
        skipped=tuple(name for name, value in fresh.items() if value is None),
    )


def _checked(name: str, value: float, wanted: ReferenceQuantity | None) -> Checked:
    if wanted is None:
        none = "no reference: give it a tolerance and a reason in the reference file"
        return Checked(name=name, value=value, low=math.nan, high=math.nan, unit="", reason=none)
    middle = math.nan if wanted.value is None else wanted.value
    return Checked(
        name=name, value=value, low=middle - wanted.tolerance, high=middle + wanted.tolerance, unit=wanted.unit,
        reason=wanted.reason,
    )  # fmt: skip


def write_junit(path: Path, result: CheckResult, *, seconds: float) -> None:
    """Write a JUnit report, which build servers read; `DataError` where that cannot be.

    It has one test case per quantity, with a failure's values as its message.
    """
    failed = sum(not check.ok for check in result.checks)
    counts = {"tests": len(result.checks) + len(result.skipped), "failures": failed, "skipped": len(result.skipped)}
    suite = ElementTree.Element("testsuite", {"name": "srbval check", "errors": "0", "time": f"{seconds:.1f}"})
    suite.attrib |= {key: str(count) for key, count in counts.items()}
    for check in result.checks:
        case = ElementTree.SubElement(suite, "testcase", {"classname": "srbval.check", "name": check.name})
        if not check.ok:
            message = f"{check.value:.9g} is not within {check.low:.9g} to {check.high:.9g} {check.unit}"
            ElementTree.SubElement(case, "failure", {"message": message}).text = check.reason
    for name in result.skipped:
        case = ElementTree.SubElement(suite, "testcase", {"classname": "srbval.check", "name": name})
        ElementTree.SubElement(case, "skipped", {"message": "needs a recording that is not registered"})
    suites = ElementTree.Element("testsuites")
    suites.append(suite)
    ElementTree.indent(suites)
    with atomic_write(path) as part:
        ElementTree.ElementTree(suites).write(part, encoding="utf-8", xml_declaration=True)


@dataclass(frozen=True, kw_only=True)
class Difference:
    """What an update would do to one quantity; `moved` is the change in tolerances, None without an old value."""

    name: str
    old: float | None
    new: float
    unit: str
    moved: float | None


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


def differences(old: Mapping[str, ReferenceQuantity], new: Mapping[str, ReferenceQuantity]) -> list[Difference]:
    """What differs between two references."""
    return [_difference(old[name], quantity) for name, quantity in new.items() if quantity.value != old[name].value]


def _difference(old: ReferenceQuantity, new: ReferenceQuantity) -> Difference:
    assert new.value is not None
    moved = None if old.value is None or not old.tolerance else (new.value - old.value) / old.tolerance
    return Difference(name=new.name, old=old.value, new=new.value, unit=new.unit, moved=moved)
