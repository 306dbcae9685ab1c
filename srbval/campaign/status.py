"""How far a campaign is, at any time, from its folder alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.case import Case
from srbval.campaign.case_file import read_result
from srbval.campaign.lock import holder
from srbval.campaign.results_table import write_table
from srbval.campaign.store import Store
from srbval.campaign.task import Ending, Outcome
from srbval.errors import DataError


@dataclass(frozen=True, kw_only=True)
class Status:
    """`done` of the `cases` have a result; `failed` are those whose result is a reason; `running` says who works on it.

    `simulation_s` is what the simulations took in sum, in all runs.
    """

    name: str
    cases: int
    done: int
    failed: tuple[dict[str, Any], ...]
    running: str | None
    simulation_s: float
    table: Path | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def campaign_status(folder: Path, *, table: bool = True) -> Status:
    """Read a campaign's folder and, unless told not to, write its results table anew.

    Raises `DataError` where there is no campaign. In a folder that can only be read there is no new table.
    """
    store = Store(folder)
    about, cases = store.about(), store.planned()
    present = store.present()
    failed = failures(store, cases)
    return Status(
        name=str(about["name"]),
        cases=len(cases),
        done=sum(case.key in present for case in cases),
        failed=tuple(failed),
        running=holder(folder),
        simulation_s=sum(float(entry.get("simulation_s") or 0.0) for entry in store.journal()),
        table=_table(store) if table else None,
    )


def _table(store: Store) -> Path | None:
    """The table, written anew; None where the folder can only be read."""
    try:
        return write_table(store)
    except DataError:
        return None


def failures(store: Store, cases: Sequence[Case], fresh: Mapping[str, Outcome] | None = None) -> list[dict[str, Any]]:
    """All cases that ended without a good result: index, key, ending and reason.

    What is not among the `fresh` outcomes is read from the journal, or from the result where its line was lost.
    """
    known = {e["key"]: (e["ending"], e["reason"]) for e in store.journal() if e["event"] == "ended"}
    known |= {key: (outcome.ending.value, outcome.reason) for key, outcome in (fresh or {}).items()}
    for key in store.present() - set(known):
        result = read_result(store.path_of(key))
        known[key] = (result.ending.value, result.reason)
    return [
        {"case": case.index, "key": case.key, "ending": known[case.key][0], "reason": known[case.key][1]}
        for case in cases
        if case.key in known and known[case.key][0] != Ending.OK.value
    ]
