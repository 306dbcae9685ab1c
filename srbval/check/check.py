"""`run_check`: compute everything anew and compare it with the reference results."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import ClassVar

from srbval.check.quantities import GROUPS
from srbval.check.reference import ReferenceQuantity, read_reference, reference_path
from srbval.errors import ConfigurationError
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene


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
