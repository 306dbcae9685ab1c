"""The tolerance regression: the program's behaviour as computed now against its reference, and what is stale.

The reference is the file ``reports/fingerprint.json``; `srbval.storage.behaviour.tolerance` states how far a number may
be from it, `StoredResult.why_stale` when evidence is stale.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from srbval import __version__
from srbval.check.fingerprint import PARTS, SEPARATOR, fingerprint
from srbval.errors import ConfigurationError
from srbval.progress import Progress, silent
from srbval.storage import behaviour
from srbval.storage.behaviour import FILE, Fingerprint, Value, differing, reference_fingerprint
from srbval.storage.installation import git_revision, shipped_folder
from srbval.storage.json_files import write_json
from srbval.storage.stored_result import REPORTS, StoredResult, read_result


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


@dataclass(frozen=True, kw_only=True)
class CheckResult:
    """Every quantity of the fingerprint against its reference, and the evidence that is `stale`: `file` and `why`."""

    JSON_PROPERTIES: ClassVar = ("ok",)

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
    checks = [one for part in now for one in _checked(part, now[part], known.get(part, {}))]
    results = () if parts else shipped_results()
    stale = tuple({"file": one.path.name, "why": why} for one in results if (why := one.why_stale(now)) is not None)
    return CheckResult(checks=tuple(checks), stale=stale, now=now)


def shipped_results() -> Sequence[StoredResult]:
    """The results that come with the program, by file name."""
    files = sorted(shipped_folder(REPORTS).glob("*.json"))
    return [one for path in files if path.name != FILE and (one := read_result(path)) is not None]


def reference_path() -> Path:
    """The reference fingerprint of this version: in the repository, or in the installed package."""
    return shipped_folder(REPORTS) / FILE


def write_reference(now: Fingerprint) -> None:
    """Replace the reference by the fingerprint of `now`, completely or not at all.

    Raises `ConfigurationError` if a number of a model's run is not finite: no reference is made of a failure.
    """
    for part, values in now.items():
        for name, value in values.items():
            if name.endswith(f"{SEPARATOR}cage_ratio") and not (isinstance(value, float) and math.isfinite(value)):
                raise ConfigurationError(f"{part}, {name} is {value}; nothing was replaced. Correct that first.")
    origin = {"schema_version": behaviour.SCHEMA_VERSION, "kind": behaviour.KIND, "srbval": __version__}
    write_json(reference_path(), origin | {"git_revision": git_revision(), "parts": now})
    reference_fingerprint.cache_clear()


def differences(old: Fingerprint, new: Fingerprint) -> list[dict[str, Any]]:
    """List the changes that an update would make: part and name, old and new value."""
    return [
        {"name": f"{part}{SEPARATOR}{name}", "old": old.get(part, {}).get(name), "new": values.get(name)}
        for part, values in new.items()
        for name in differing(old.get(part, {}), values)
    ]


def _checked(part: str, now: Mapping[str, Value], known: Mapping[str, Value]) -> list[CheckedQuantity]:
    """The quantities of one part; a number that only the reference or only the program has fails."""
    found = []
    for name in {**known, **now}:
        full, value, middle = f"{part}{SEPARATOR}{name}", now.get(name, math.nan), known.get(name, math.nan)
        ok, words, near = name in now and name in known and behaviour.same(name, value, middle), None, 0.0
        if isinstance(value, str) or isinstance(middle, str):
            words, value, middle = (str(middle), str(value)), float(ok), 1.0
        else:
            near = behaviour.tolerance(name, middle)
        found.append(CheckedQuantity(name=full, value=value, low=middle - near, high=middle + near, ok=ok, words=words))
    return found
