"""The tolerance regression: the program's behaviour as computed now against its reference, and what is stale.

The reference is the file ``reports/fingerprint.json``; `srbval.storage.stored_result` states how far a number may be
from it, and when evidence is stale.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

from srbval import __version__
from srbval.check.fingerprint import PARTS, SEPARATOR, fingerprint
from srbval.errors import ConfigurationError
from srbval.progress import Progress, silent
from srbval.storage import stored_result
from srbval.storage.installation import git_revision, shipped_folder
from srbval.storage.json_files import write_json
from srbval.storage.stored_result import (
    CheckedQuantity,
    Fingerprint,
    StoredResult,
    compared,
    read_result,
    reference_fingerprint,
)


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """Every quantity of the fingerprint against its reference, and the evidence that is `stale`: `file` and `why`."""

    JSON_PROPERTIES: ClassVar = ("ok",)
    JSON_OMITTED: ClassVar = ("now",)

    checks: tuple[CheckedQuantity, ...]
    stale: tuple[Mapping[str, str], ...]
    now: Fingerprint

    @property
    def ok(self) -> bool:
        """True if every quantity is within its range and no evidence is stale."""
        return not self.stale and all(check.ok for check in self.checks)


def run_check(*parts: str, reference: Fingerprint | None = None, progress: Progress = silent) -> CheckResult:
    """Compute the fingerprint of these `parts` (all), compare it with the `reference` (the shipped one).

    Evidence is compared with the fingerprint of now if all parts are computed. Raises `ConfigurationError` for an
    unknown part, and what running a bundled scene or reading a shipped recording raises.
    """
    unknown = [part for part in parts if part not in PARTS]
    if unknown:
        raise ConfigurationError(f"part {unknown[0]!r} is not known. Known: {', '.join(PARTS)}.")
    known = reference_fingerprint() if reference is None else reference
    now = fingerprint(*parts, progress=progress)
    checks = [
        replace(one, name=f"{part}{SEPARATOR}{one.name}")
        for part, values in now.items()
        for one in compared(values, known.get(part, {}))
    ]
    results = () if parts else shipped_results()
    stale = tuple({"file": one.path.name, "why": why} for one in results if (why := one.why_stale(now)) is not None)
    return CheckResult(checks=tuple(checks), stale=stale, now=now)


def shipped_results() -> Sequence[StoredResult]:
    """The results that come with the program, by file name."""
    files = sorted(shipped_folder(stored_result.REPORTS).glob("*.json"))
    return [one for path in files if path.name != stored_result.REFERENCE and (one := read_result(path)) is not None]


def reference_path() -> Path:
    """The reference fingerprint of this version: in the repository, or in the installed package."""
    return shipped_folder(stored_result.REPORTS) / stored_result.REFERENCE


def write_reference(now: Fingerprint) -> None:
    """Replace the reference by the fingerprint of `now`, completely or not at all.

    Raises `ConfigurationError` if a number of a model's run is not finite: no reference is made of a failure.
    """
    for part, values in now.items():
        for name, value in values.items():
            if name.endswith(f"{SEPARATOR}cage_ratio") and not (isinstance(value, float) and math.isfinite(value)):
                raise ConfigurationError(f"{part}, {name} is {value}; nothing was replaced. Correct that first.")
    origin = stored_result.REFERENCE_ORIGIN | {"srbval": __version__, "git_revision": git_revision()}
    write_json(reference_path(), origin | {"parts": now})
    reference_fingerprint.cache_clear()


def differences(old: Fingerprint, new: Fingerprint) -> list[dict[str, Any]]:
    """List the changes that an update would make: part and name, old and new value."""
    return [
        {"name": f"{part}{SEPARATOR}{one.name}", "old": old.get(part, {}).get(one.name), "new": values.get(one.name)}
        for part, values in new.items()
        for one in compared(values, old.get(part, {}))
        if not one.ok
    ]
