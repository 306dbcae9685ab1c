"""New reference values from a new run: shown as differences first, then written."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from srbval.check.check import CheckResult
from srbval.check.reference import ReferenceQuantity
from srbval.errors import ConfigurationError


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
