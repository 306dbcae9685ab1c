"""How far a campaign is, and whether its folder is as it was written, from that folder alone; its table of results."""

import contextlib
import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from srbval.campaign.case import CampaignCase, CaseResult, Ending
from srbval.campaign.folder import HOLDER, TABLE, CampaignFolder, Damaged, holder
from srbval.errors import DataError
from srbval.storage.files import atomic_write

LAST_COLUMNS = ("model", "status", "reason", "quantity", "value", "unit")


@dataclass(frozen=True, kw_only=True)
class CampaignStatus:
    """`done` of the `cases` have a result; `failed` are those without a good one; `running` names who works on it.

    `damaged`: results, and the journal, that are not as they were written; such cases are not done.
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


@dataclass(frozen=True, kw_only=True)
class CampaignVerification:
    """`ok` if none of the files is `damaged`, or gone; `results` is how many results were read."""

    ok: bool
    results: int
    damaged: tuple[Damaged, ...]


def campaign_status(path: Path) -> CampaignStatus:
    """Read a campaign's folder and rewrite its results table.

    Raises `DataError` where there is no campaign, or its plan is damaged.
    """
    folder = CampaignFolder(path)
    journal = folder.journal(planned=True)
    results, damaged = folder.read_results(case.key for case in journal.cases)
    try:
        table = write_table(folder, journal.cases, results)
    except DataError:  # a folder that can only be read
        table = None
    ended = [result for result in journal.ended if result.key not in damaged]
    return CampaignStatus(
        name=journal.about.name if journal.about else "",
        cases=len(journal.cases),
        done=sum(case.key in results for case in journal.cases),
        failed=tuple(failures(journal.cases, results, ended)),
        damaged=(*folder.damaged(journal), *damaged.values()),
        running=holder(path),
        simulation_s=sum(result.simulation_s for result in journal.ended),
        table=table,
    )


def verify_campaign(path: Path) -> CampaignVerification:
    """Read the plan, the journal and all results, those of other plans too; nothing is changed.

    The table of results is checked once the campaign has ended. Raises `DataError` where there is no campaign.
    """
    folder = CampaignFolder(path)
    journal = folder.journal()
    damaged, cases = folder.damaged(journal), journal.cases
    planned = {case.key for case in cases}
    results, bad = folder.read_results([*planned, *sorted(folder.result_keys())])
    for key, found in bad.items():
        left = key not in planned and bool(planned)
        damaged.append(replace(found, why=f"{found.why} It is not in this plan: remove it.") if left else found)
    ended = {result.key for result in journal.ended if result.ending.final}
    damaged += [
        Damaged(file=folder.result_path(key), why="missing, though the journal says that its case ended")
        for key in sorted(planned & ended - results.keys() - bad.keys())
    ]
    if planned and planned <= results.keys() and not (path / HOLDER).exists():
        table, now = path / TABLE, table_text(cases, results).encode()
        same = False
        with contextlib.suppress(OSError):
            same = table.is_file() and table.stat().st_size == len(now) and table.read_bytes() == now
        if not same:
            why = f"not the table of these results. It is written again by: srbval campaign status {path}"
            damaged.append(Damaged(file=table, why=why))
    return CampaignVerification(ok=not damaged, results=len(results) + len(bad), damaged=tuple(damaged))


def failures(
    cases: Sequence[CampaignCase], results: Mapping[str, CaseResult], ended: Iterable[CaseResult]
) -> list[dict[str, Any]]:
    """All cases that ended without a good result: index, key, ending and reason.

    What has no result is found among those that `ended`, if their result could not be written or was removed again.
    """
    known = {result.key: result for result in ended if not result.ending.final} | dict(results)
    found = [(case.index, known[case.key]) for case in cases if case.key in known]
    return [
        {"case": index, "key": result.key, "ending": result.ending.value, "reason": result.reason}
        for index, result in found
        if not result.ending.usable
    ]


def write_table(folder: CampaignFolder, cases: Sequence[CampaignCase], results: Mapping[str, CaseResult]) -> Path:
    """Write `table_text` and return its path; `DataError` where that fails."""
    path = folder.path / TABLE
    with atomic_write(path) as part:
        part.write_bytes(table_text(cases, results).encode())
    return path


def table_text(cases: Sequence[CampaignCase], results: Mapping[str, CaseResult]) -> str:
    """The table of results as CSV: one row per case and quantity, in the order of the plan.

    A case that failed has one row without a quantity; one without an intact result has none. The same results give the
    same text.
    """
    columns = list(dict.fromkeys(key for case in cases for key in case.point))
    stream = io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow(["case", "key", *columns, *LAST_COLUMNS])
    for case in cases:
        if (result := results.get(case.key)) is not None:
            reason = "" if result.ending is Ending.OK and result.quantities else result.reason
            first = [case.index, case.key, *(case.point.get(c, "") for c in columns), case.model, result.ending, reason]
            rows = [(q.name, repr(q.value), q.unit) for q in result.quantities] or [("", "", "")]
            writer.writerows([*first, *row] for row in rows)
    return stream.getvalue()
