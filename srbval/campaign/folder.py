"""The folder of a campaign: its table of cases, one result file per case, and the results as CSV.

`srbval-campaign.json` contains the campaign and its cases; it follows from the campaign file, and every run writes it.
Only the result files record the progress, so a killed campaign loses nothing that had ended.
"""

import contextlib
import csv
import io
import json
import os
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.cases import CampaignCase
from srbval.campaign.results import CaseResult, Ending, read_result
from srbval.campaign.settings import Campaign
from srbval.campaign.worker import version
from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.hdf5_files import END_BYTES, append_checksum, checked_summary
from srbval.storage.json_files import from_json, parse_json, to_json

TABLE, RESULTS, CASES, LOCK = "srbval-campaign.json", "results.csv", "cases", "lock"
NAME = re.compile(rb'\{"campaign": \{"name": "([^"]+)"')  # at the start of the file `TABLE`
Damage = dict[str, Any]  # a `file` that is not as it was written, and `why`


@dataclass(frozen=True, kw_only=True)
class CampaignTable:
    """A campaign and its cases; `version` is that of the code that computes the results."""

    campaign: Campaign
    version: str
    cases: tuple[CampaignCase, ...]


def result_path(folder: Path, key: str) -> Path:
    """The file of the result with that key."""
    return folder / CASES / f"{key}.h5"


def write_cases(folder: Path, campaign: Campaign, cases: Sequence[CampaignCase]) -> None:
    """Write the table of cases; call it with the folder locked.

    Raises `ConfigurationError` if the folder contains another campaign, `DataError` if it contains files of the same
    names that are not a campaign's, or cannot be written.
    """
    if any(os.path.lexists(folder / name) for name in (TABLE, RESULTS)):
        start = NAME.match((folder / TABLE).read_bytes()) if (folder / TABLE).is_file() else None
        if start is None:
            raise DataError(
                f"{folder}: {TABLE} is damaged or missing, so nothing says whose folder it is; nothing was changed. If "
                f"it is campaign {campaign.name!r}, remove {TABLE} and {RESULTS}, and give the same command again: "
                "intact results are used. If not: another -o."
            )
        if (owner := start[1].decode(errors="replace")) != campaign.name:
            raise ConfigurationError(f"{folder} holds campaign {owner!r}, not {campaign.name!r}; choose another -o.")
    table = CampaignTable(campaign=campaign, version=version(), cases=tuple(cases))
    with atomic_write(folder / TABLE) as part:
        part.write_bytes(json.dumps(to_json(table)).encode())
        append_checksum(part)


def read_cases(folder: Path) -> CampaignTable:
    """The table of cases; `DataError` if there is no campaign, or its table is not as it was written."""
    file = folder / TABLE
    try:
        if not file.is_file() or checked_summary(file) is None:
            raise ValueError("it has no checksum")
        return from_json(CampaignTable, parse_json(file.read_bytes()[:-END_BYTES]))
    except (OSError, ValueError, DataError) as error:
        again = f"srbval campaign run FILE.toml -o {folder}"
        if not folder.is_dir() or not os.path.lexists(file):
            raise DataError(f"{folder}: no campaign here. Start one: {again}") from None
        why = str(error).removeprefix(f"{file}: ")
        raise DataError(f"{file}: damaged ({why}). It is written again, and results are kept: {again}") from None


def read_results(folder: Path, keys: Iterable[str]) -> tuple[dict[str, CaseResult], list[Damage]]:
    """The results of `keys` that are intact, and the damaged ones (`file`, `why`); the others are missing."""
    intact, damaged = dict[str, CaseResult](), list[Damage]()
    for key in dict.fromkeys(keys):
        path = result_path(folder, key)
        if os.path.lexists(path):
            try:
                intact[key] = read_result(path)
            except DataError as error:
                damaged.append({"file": path, "why": str(error).removeprefix(f"{path}: ")})
    return intact, damaged


def remove_incomplete(folder: Path) -> None:
    """Remove the half-written files of killed processes; call it with the folder locked."""
    remove_unfinished(folder, {TABLE, RESULTS}.__contains__)
    remove_unfinished(folder / CASES, lambda name: name.endswith(".h5"))


def campaign_status(path: Path) -> dict[str, Any]:
    """Read the folder of a campaign and write its results table again; `DataError` as `read_cases`.

    Returns the document of ``campaign status``. Cases with `damaged` results (`file`, `why`) are not `done`; `table` is
    None if the results table cannot be written.
    """
    table = read_cases(path)
    results, damaged = read_results(path, (case.key for case in table.cases))
    written, running = None, False
    with contextlib.suppress(DataError):  # a folder that can only be read
        written = write_results(path, table.cases, results)
        try:
            with folder_lock(path):
                pass
        except ConfigurationError:
            running = True
    counts = counted(table.campaign, table.cases, results, {})
    return counts | {"damaged": damaged, "running": running, "table": written}


def verify_campaign(path: Path) -> dict[str, Any]:
    """Read the table of cases and all results, those of earlier tables too; nothing is changed.

    Returns the document of ``campaign verify``: `ok` if no file is `damaged` (`file`, `why`), and the number of
    `results` that were read. Raises `DataError` if there is no campaign.
    """
    results, damaged = read_results(path, sorted(file.stem for file in (path / CASES).glob("*.h5")))
    count, table = len(results) + len(damaged), path / TABLE
    try:
        read_cases(path)
    except DataError as error:
        if not os.path.lexists(table):
            raise
        damaged.append({"file": table, "why": str(error).removeprefix(f"{table}: ")})
    return {"ok": not damaged, "results": count, "damaged": damaged}


def counted(
    campaign: Campaign, cases: Sequence[CampaignCase], results: Mapping[str, CaseResult], ran: Mapping[str, CaseResult]
) -> dict[str, Any]:
    """Name, number of `cases`, of those with a result (`done`), and the `failed` ones, `ran` without a result too."""
    found = ((case, results.get(case.key, ran.get(case.key))) for case in cases)
    failed = [
        {"case": case.index, "key": case.key, "ending": result.ending.value, "reason": result.reason}
        for case, result in found
        if result is not None and not result.ending.usable
    ]
    done = sum(case.key in results for case in cases)
    return {"name": campaign.name, "cases": len(cases), "done": done, "failed": failed}


def write_results(folder: Path, cases: Sequence[CampaignCase], results: Mapping[str, CaseResult]) -> Path:
    """Write the results as CSV: one row per case and quantity, in the order of the cases; returns the file.

    A failed case has one row without a quantity; a case without an intact result has none. The same results give the
    same text. Raises `DataError` if the file cannot be written.
    """
    points = dict.fromkeys(key for case in cases for key in case.point)
    stream = io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow(["case", "key", *points, "model", "status", "reason", "quantity", "value", "unit"])
    for case in cases:
        if (result := results.get(case.key)) is not None:
            reason = "" if result.ending is Ending.OK and result.quantities else result.reason
            first = [case.index, case.key, *(case.point.get(c, "") for c in points), case.model, result.ending, reason]
            rows = [(name, repr(value), unit) for name, (value, unit) in result.quantities.items()]
            writer.writerows([*first, *row] for row in rows or [("", "", "")])
    with atomic_write(folder / RESULTS) as part:
        part.write_bytes(stream.getvalue().encode("utf-8", "replace"))
    return folder / RESULTS


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Hold `folder` exclusively; the system releases the lock when the process ends, for whatever reason.

    Raises `ConfigurationError` if another process holds it, `DataError` if the folder cannot be written.
    """
    from filelock import FileLock, Timeout

    try:
        folder.mkdir(parents=True, exist_ok=True)
        acquired = FileLock(folder / LOCK, blocking=False).acquire()
    except Timeout:
        raise ConfigurationError(
            f"{folder}: another campaign runs in this folder. Wait for its end (srbval campaign status {folder}), or "
            "choose another -o."
        ) from None
    except OSError as error:
        raise DataError(
            f"{folder}: cannot be written ({error.strerror}). Choose another folder with -o, or free this one."
        ) from None
    with acquired:
        yield
