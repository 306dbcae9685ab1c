"""How far a campaign is, from its folder alone; and its table of results."""

import csv
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.campaign_folder import ENDED, TABLE, CampaignFolder
from srbval.campaign.case import CampaignCase, CaseOutcome, Ending
from srbval.campaign.case_file import read_result
from srbval.campaign.lock import holder
from srbval.errors import DataError
from srbval.storage.whole_file import whole_file

LAST_COLUMNS = ("model", "status", "reason", "quantity", "value", "unit")


@dataclass(frozen=True, kw_only=True)
class CampaignStatus:
    """`done` of the `cases` have a result; `failed` are those without a good one; `running` names who works on it.

    `simulation_s` is the sum over all simulations of all runs; `table` is None where it cannot be written.
    """

    name: str
    cases: int
    done: int
    failed: tuple[dict[str, Any], ...]
    running: str | None
    simulation_s: float
    table: Path | None


def campaign_status(path: Path) -> CampaignStatus:
    """Read a campaign's folder and write its results table anew; `DataError` where there is no campaign."""
    folder = CampaignFolder(path)
    about, cases = folder.about(), folder.planned()
    keys = folder.result_keys()
    try:
        table = write_table(folder)
    except DataError:  # a folder that can only be read
        table = None
    return CampaignStatus(
        name=about["name"],
        cases=len(cases),
        done=sum(case.key in keys for case in cases),
        failed=tuple(failures(folder, cases)),
        running=holder(path),
        simulation_s=sum(float(entry.get("simulation_s") or 0.0) for entry in folder.journal()),
        table=table,
    )


def failures(
    folder: CampaignFolder, cases: Sequence[CampaignCase], outcomes: Mapping[str, CaseOutcome] | None = None
) -> list[dict[str, Any]]:
    """All cases that ended without a good result: index, key, ending and reason.

    What is not among the `outcomes` of this run is read from the journal, or from the result if its entry was lost.
    """
    known = {e["key"]: (e["ending"], e["reason"]) for e in folder.journal() if e["event"] == ENDED}
    known |= {key: (outcome.ending.value, outcome.reason) for key, outcome in (outcomes or {}).items()}
    for key in folder.result_keys() - set(known):
        result = read_result(folder.result_path(key))
        known[key] = (result.ending.value, result.reason)
    return [
        {"case": case.index, "key": case.key, "ending": known[case.key][0], "reason": known[case.key][1]}
        for case in cases
        if case.key in known and known[case.key][0] != Ending.OK.value
    ]


def write_table(folder: CampaignFolder) -> Path:
    """Write the table of results as CSV and return its path: one row per case and quantity, in the order of the plan.

    A case that failed has one row without a quantity; one that has not run yet has none. The same results give the
    same bytes.
    """
    cases = folder.planned()
    path = folder.path / TABLE
    columns = list(dict.fromkeys(key for case in cases for key in case.point))
    try:
        with whole_file(path) as part, part.open("w", encoding="utf-8", newline="") as stream:
            writer = csv.writer(stream)
            writer.writerow(["case", "key", *columns, *LAST_COLUMNS])
            for case in cases:
                writer.writerows(_rows(folder, case, columns))
    except OSError as error:
        raise DataError(f"{path}: the table cannot be written ({error.strerror}). Free some space.") from None
    return path


def _rows(folder: CampaignFolder, case: CampaignCase, columns: Sequence[str]) -> Iterator[list[object]]:
    path = folder.result_path(case.key)
    if not path.exists():
        return
    result = read_result(path)
    first = [case.index, case.key, *(case.point.get(c, "") for c in columns), case.model, result.ending.value]
    if not result.quantities:
        yield [*first, result.reason, "", "", ""]
    for quantity in result.quantities:
        yield [*first, "", quantity.name, repr(quantity.value), quantity.unit]
