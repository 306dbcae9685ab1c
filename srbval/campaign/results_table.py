"""The results table: one row a case and quantity, in the order of the plan; the same for the same results."""

from __future__ import annotations

import csv
from collections.abc import Iterator, Sequence
from pathlib import Path

from srbval.campaign.case import Case
from srbval.campaign.case_file import read_result
from srbval.campaign.store import TABLE, Store
from srbval.errors import DataError
from srbval.storage.whole_file import whole_file

LAST = ("model", "status", "reason", "quantity", "value", "unit")


def write_table(store: Store) -> Path:
    """Write the table of all results that are there as CSV and return where it is.

    A case that failed has one row, without a quantity; one that has not run yet has none.
    """
    cases = store.planned()
    path = store.folder / TABLE
    columns = _columns(cases)
    try:
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["case", "key", *columns, *LAST])
            for case in cases:
                writer.writerows(_rows(store, case, columns))
    except OSError as error:
        raise DataError(f"{path}: the table cannot be written ({error.strerror}). Free some space.") from None
    return path


def _columns(cases: Sequence[Case]) -> list[str]:
    """Every key that a case changes, in the order met."""
    return list(dict.fromkeys(key for case in cases for key in case.point))


def _rows(store: Store, case: Case, columns: Sequence[str]) -> Iterator[list[object]]:
    path = store.path_of(case.key)
    if not path.exists():
        return
    result = read_result(path)
    start = [case.index, case.key, *(case.point.get(c, "") for c in columns), case.model, result.ending.value]
    reason = "" if result.quantities else result.reason
    for q in result.quantities:
        yield [*start, reason, q.name, repr(q.value), q.unit]
    if not result.quantities:
        yield [*start, reason, "", "", ""]
