"""Is a campaign's folder as it was written? Everything in it is read; nothing is changed."""

import contextlib
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.campaign.campaign_folder import TABLE, CampaignFolder, Damaged
from srbval.campaign.case import FINAL
from srbval.campaign.lock import HOLDER
from srbval.campaign.results import Results
from srbval.campaign.status import table_text
from srbval.errors import DataError


@dataclass(frozen=True, kw_only=True)
class CampaignVerification:
    """`ok` if none of the files is `damaged`, or gone; `results` is how many results were read."""

    ok: bool
    results: int
    damaged: tuple[Damaged, ...]


def verify_campaign(path: Path) -> CampaignVerification:
    """Check the campaign file, the plan, the journal and all results, those of other plans too.

    The table of results is checked once the campaign has ended. Raises `DataError` where there is no campaign.
    """
    folder = CampaignFolder(path)
    damaged = folder.damaged()
    try:
        cases = folder.planned()
    except DataError:
        cases = []
    planned = {case.key for case in cases}
    results = Results(folder, [*planned, *sorted(folder.result_keys())])
    for key, found in results.damaged.items():
        left = key not in planned and bool(planned)
        damaged.append(replace(found, why=f"{found.why} It is not in this plan: remove it.") if left else found)
    ended = {entry.key for entry in folder.journal() if entry.ending in FINAL}
    for key in sorted(planned & ended - results.intact.keys() - results.damaged.keys()):
        damaged.append(
            Damaged(file=folder.result_path(key), why="missing, though the journal says that its case ended")
        )
    if planned and planned <= results.intact.keys() and not (path / HOLDER).exists():
        table, now = path / TABLE, table_text(cases, results).encode()
        same = False
        with contextlib.suppress(OSError):
            same = table.is_file() and table.stat().st_size == len(now) and table.read_bytes() == now
        if not same:
            why = f"not the table of these results. It is written again by: srbval campaign status {path}"
            damaged.append(Damaged(file=table, why=why))
    read = len(results.intact) + len(results.damaged)
    return CampaignVerification(ok=not damaged, results=read, damaged=tuple(damaged))
