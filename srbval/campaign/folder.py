"""The folder of a campaign: its table of cases, one result file per case, and the results as CSV.

`srbval-campaign.json` contains the campaign and its cases; it follows from the campaign file, and every run writes it.
Only the result files record the progress, so a killed campaign loses nothing that had ended.
"""

import contextlib
import csv
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.cases import CampaignCase
from srbval.campaign.results import REFUSED, CaseResult, intact_result, read_result
from srbval.campaign.settings import Campaign
from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.hdf5_files import END_BYTES, append_checksum, checked_summary
from srbval.storage.json_files import from_json, parse_json, to_json

TABLE, RESULTS, CASES, LOCK = "srbval-campaign.json", "results.csv", "cases", "lock"


@dataclass(frozen=True, kw_only=True)
class CampaignTable:
    """A campaign and its cases; `version` is that of the code that computes the results."""

    campaign: Campaign
    version: str
    cases: tuple[CampaignCase, ...]


def result_path(folder: Path, key: str) -> Path:
    """The file of the result with that key."""
    return folder / CASES / f"{key}.h5"


def write_table(folder: Path, table: CampaignTable) -> None:
    """Write the table of cases, and remove half-written files of killed processes; call it with the folder locked.

    Raises `ConfigurationError` if the folder contains files of these names that are not of this campaign, `DataError`
    if it cannot be written.
    """
    file, name = folder / TABLE, table.campaign.name
    own = file.is_file() and file.read_bytes().startswith(f'{{"campaign": {{"name": "{name}"'.encode())
    if not own and any(os.path.lexists(path) for path in (file, folder / RESULTS)):
        raise ConfigurationError(
            f"{folder}: its {TABLE} or {RESULTS} is not of campaign {name!r}; nothing was changed. Choose another -o, "
            "or if they are damaged files of this campaign, remove both: its results are kept."
        )
    with atomic_write(file) as part:
        part.write_bytes(json.dumps(to_json(table)).encode())
        append_checksum(part)
    remove_incomplete(folder)


def remove_incomplete(folder: Path) -> None:
    """Remove the half-written files of killed processes; call it with the folder locked."""
    remove_unfinished(folder, {TABLE, RESULTS}.__contains__)
    remove_unfinished(folder / CASES, lambda name: name.endswith(".h5"))


def read_table(folder: Path) -> CampaignTable:
    """The table of cases; `DataError` if there is no campaign, or its table is not as it was written."""
    file, again = folder / TABLE, f"srbval campaign run FILE.toml -o {folder}"
    if not os.path.lexists(file):
        raise DataError(f"{folder}: no campaign here. Start one: {again}")
    try:
        if not file.is_file() or checked_summary(file) is None:
            raise ValueError("it has no checksum")
        return from_json(CampaignTable, parse_json(file.read_bytes()[:-END_BYTES]))
    except (OSError, ValueError, DataError) as error:
        why = str(error).removeprefix(f"{file}: ")
        raise DataError(f"{file}: damaged ({why}). It is written again, and results are kept: {again}") from None


def read_results(folder: Path, table: CampaignTable) -> dict[str, CaseResult]:
    """The results that are there and not damaged, by key, and those of refused cases, which have no file."""
    found = {
        case.key: intact_result(result_path(folder, case.key))
        if case.refused is None
        else CaseResult(key=case.key, status=REFUSED, reason=case.refused)
        for case in table.cases
    }
    return {key: result for key, result in found.items() if result is not None}


def counted(table: CampaignTable, results: Mapping[str, CaseResult]) -> dict[str, Any]:
    """Name of a campaign, number of `cases`, of those with a result (`done`), and the `failed` ones."""
    found = [(case.index, results[case.key]) for case in table.cases if case.key in results]
    failed = [
        {"case": index, "key": result.key, "status": result.status, "reason": result.reason}
        for index, result in found
        if not result.usable
    ]
    return {"name": table.campaign.name, "cases": len(table.cases), "done": len(found), "failed": failed}


def write_results(folder: Path, table: CampaignTable, results: Mapping[str, CaseResult]) -> Path:
    """Write the results as CSV: one row per case and quantity, in the order of the cases; returns the file.

    A failed case has one row without a quantity; a case without an intact result has none. The same results give the
    same text. Raises `DataError` if the file cannot be written.
    """
    points = dict.fromkeys(key for case in table.cases for key in case.point)
    columns = ["case", "key", *points, "model", "status", "reason", "quantity", "value", "unit"]
    with (
        atomic_write(folder / RESULTS) as part,
        part.open("w", newline="", encoding="utf-8", errors="replace") as stream,
    ):
        writer = csv.DictWriter(stream, columns)
        writer.writeheader()
        for case in table.cases:
            if (result := results.get(case.key)) is not None:
                about = {**case.point, "case": case.index, "key": case.key, "model": case.model}
                about |= {"status": result.status, "reason": "" if result.status == "ok" else result.reason}
                numbers = [{"quantity": n, "value": v, "unit": u} for n, (v, u) in result.quantities.items()]
                writer.writerows(about | row for row in numbers or [{}])
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


def campaign_status(path: Path) -> dict[str, Any]:
    """Read the folder of a campaign and write its results table again; `DataError` as `read_table`.

    Returns the document of ``campaign status``. Cases with damaged results are not `done`; `table` is None if the
    results table cannot be written.
    """
    table = read_table(path)
    results = read_results(path, table)
    written, running = None, False
    with contextlib.suppress(DataError):  # a folder that can only be read
        written = write_results(path, table, results)
        try:
            with folder_lock(path):
                pass
        except ConfigurationError:
            running = True
    return counted(table, results) | {"running": running, "table": written}


def verify_campaign(path: Path) -> dict[str, Any]:
    """Read the table of cases and all results, those of earlier tables too; nothing is changed.

    Returns the document of ``campaign verify``: `ok` if no file is `damaged` (`file`, `why`), and the number of
    `results` that were read. Raises `DataError` if there is no campaign.
    """
    results, damaged = sorted((path / CASES).glob("*.h5")), []
    for file in (path / TABLE, *results):
        try:
            read_table(path) if file.name == TABLE else read_result(file)
        except DataError as error:
            if not os.path.lexists(file):
                raise
            damaged.append({"file": file, "why": str(error).removeprefix(f"{file}: ")})
    return {"ok": not damaged, "results": len(results), "damaged": damaged}
