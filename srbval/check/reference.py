"""Reference results: a value for every quantity, how far a new one may be from it, and why that far."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import atomic_write, read_limited
from srbval.storage.installation import git_revision, shipped_folder
from srbval.storage.json_files import parse_json, write_json
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
    try:
        content = parse_json(read_limited(path))
    except ValueError as error:
        raise DataError(f"{path}: not JSON ({error}).") from None
    if not isinstance(content, dict) or (content.get("kind"), content.get("schema_version")) != (KIND, SCHEMA_VERSION):
        raise DataError(f"{path}: not a reference file of version {SCHEMA_VERSION}.")
    tables = content.get("quantities", [])
    if not isinstance(tables, list) or not tables:
        raise DataError(f"{path}: its quantities are not a list, or an empty one.")
    listed = [build(ReferenceQuantity, _without_null(table), f"{path.name}[{i}]") for i, table in enumerate(tables)]
    quantities = {q.name: q for q in listed}
    if len(quantities) != len(listed):
        raise DataError(f"{path}: a quantity is named twice.")
    return quantities


def _without_null(table: Any) -> Any:
    return {k: v for k, v in table.items() if v is not None} if isinstance(table, dict) else table


def write_reference(path: Path, quantities: Mapping[str, ReferenceQuantity]) -> None:
    """Write `path` and, for spreadsheets, the same table beside it as CSV; each completely or not at all."""
    rows = [asdict(quantity) for quantity in quantities.values()]
    text = io.StringIO()
    table = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    table.writeheader()
    table.writerows(rows)
    origin: dict[str, Any] = {"srbval": __version__, "git_revision": git_revision()}
    write_json(path, {"schema_version": SCHEMA_VERSION, "kind": KIND, **origin, "quantities": rows})
    with atomic_write(path.with_suffix(".csv")) as part:
        part.write_text(text.getvalue(), encoding="utf-8")
