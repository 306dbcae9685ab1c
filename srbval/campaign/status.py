"""How far a campaign is, from its folder alone; and its table of results."""

import csv
import io
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.campaign_folder import TABLE, CampaignFolder, Damaged
from srbval.campaign.case import FINAL, CampaignCase, CaseOutcome, Ending
from srbval.campaign.lock import holder
from srbval.campaign.results import Results
from srbval.errors import DataError
from srbval.storage.files import atomic_write

LAST_COLUMNS = ("model", "status", "reason", "quantity", "value", "unit")


@dataclass(frozen=True, kw_only=True)
class CampaignStatus:
    """`done` of the `cases` have a result; `failed` are those without a good one; `running` names who works on it.

    `damaged`: results, and lines of the journal, that are not as they were written; such cases are not done.
    `simulation_s` is the sum over all simulations of all runs; `table` is None where it cannot be written.
    """

    name: str
    cases: int
    done: int
    failed: tuple[dict[str, Any], ...]
    damaged: tuple[Damaged, ...]
    running: str | None
    simulation_s: float
    table: Path | None


def campaign_status(path: Path) -> CampaignStatus:
    """Read a campaign's folder and rewrite its results table.

    Raises `DataError` where there is no campaign, or where its campaign file or plan is damaged.
    """
    folder = CampaignFolder(path)
    about, cases = folder.about(), folder.planned()
    results, journal = Results(folder, (case.key for case in cases)), folder.journal()
    try:
        table = write_table(folder, cases, results)
    except DataError:  # a folder that can only be read
        table = None
    return CampaignStatus(
        name=about.name,
        cases=len(cases),
        done=sum(case.key in results.intact for case in cases),
        failed=tuple(failures(cases, results, journal)),
        damaged=(*folder.damaged(), *results.damaged.values()),
        running=holder(path),
        simulation_s=sum(entry.simulation_s for entry in journal),
        table=table,
    )


def failures(cases: Sequence[CampaignCase], results: Results, ended: Iterable[CaseOutcome]) -> list[dict[str, Any]]:
    """All cases that ended without a good result: index, key, ending and reason.

    What has no result is found among those that `ended`, if their result could not be written or was removed again.
    """
    known = {e.key: (e.ending, e.reason) for e in ended if e.ending not in FINAL and e.key not in results.damaged}
    known |= {key: (result.ending, result.reason) for key, result in results.intact.items()}
    return [
        {"case": case.index, "key": case.key, "ending": known[case.key][0].value, "reason": known[case.key][1]}
        for case in cases
        if case.key in known and not known[case.key][0].usable
    ]


def write_table(folder: CampaignFolder, cases: Sequence[CampaignCase], results: Results) -> Path:
    """Write `table_text` and return its path; `DataError` where that fails."""
    path = folder.path / TABLE
    try:
        with atomic_write(path) as part:
            part.write_bytes(table_text(cases, results).encode())
    except OSError as error:
        raise DataError(f"{path}: the table cannot be written ({error.strerror}). Free some space.") from None
    return path


def table_text(cases: Sequence[CampaignCase], results: Results) -> str:
    """The table of results as CSV: one row per case and quantity, in the order of the plan.

    A case that failed has one row without a quantity; one without an intact result has none. The same results give the
    same text.
    """
    columns = list(dict.fromkeys(key for case in cases for key in case.point))
    stream = io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow(["case", "key", *columns, *LAST_COLUMNS])
    for case in cases:
        writer.writerows(_rows(case, results, columns))
    return stream.getvalue()


def _rows(case: CampaignCase, results: Results, columns: Sequence[str]) -> Iterator[list[object]]:
    result = results.intact.get(case.key)
    if result is None:
        return
    first = [case.index, case.key, *(case.point.get(c, "") for c in columns), case.model, result.ending.value]
    if not result.quantities:
        yield [*first, result.reason, "", "", ""]
    reason = "" if result.ending is Ending.OK else result.reason
    for quantity in result.quantities:
        yield [*first, reason, quantity.name, repr(quantity.value), quantity.unit]
