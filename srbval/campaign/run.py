"""Campaign folder: the table of cases, one result file per case, and all results as CSV.

`srbval-campaign.json` contains the campaign and its cases; every run rewrites it. Cases that have a result are skipped;
an engine runs the others. Only the result files record the progress, so a killed campaign loses no finished case.
"""

import contextlib
import json
import os
import shutil
import time
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
import pandas as pd

from srbval import __version__
from srbval.bearing import Fault
from srbval.bridges import require_xarray
from srbval.campaign.cases import Campaign, CampaignCase, campaign_of, plan_cases, scene_of_point
from srbval.campaign.engines import LOCAL, Engine, choose_engine
from srbval.campaign.results import COMPUTED_BY, REFUSED, CaseResult, CaseTask, read_case_result, read_intact_result
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.models.run import USABLE, WORKING, RunStatus, works
from srbval.models.simulate import compile_for
from srbval.progress import Progress, silent
from srbval.recordings.manifest import CAMPAIGN_JSON, RESULTS_FOLDER
from srbval.storage.files import atomic_write, remove_unfinished
from srbval.storage.hdf5_files import FOOTER_BYTES, append_checksum, checked_summary
from srbval.storage.json_files import parse_json, to_json
from srbval.storage.sources import content_version
from srbval.storage.tables import build, number_and_unit

if TYPE_CHECKING:
    import xarray

NO_RESULT = "missing"  # status of a case without an intact result
RESULTS_CSV, LOCK = "results.csv", "lock"


@dataclass(frozen=True, kw_only=True)
class CampaignTable:
    """Campaign and its cases in `folder`; `version` is the hash of the code that computes the results of the cases."""

    JSON_OMITTED: ClassVar = ("folder",)

    campaign: Campaign
    version: str
    cases: tuple[CampaignCase, ...]
    folder: Path = Path()

    def to_frame(self) -> pd.DataFrame:
        """Pandas table with one row per case: changed inputs, model, status, reason and numbers."""
        return pd.DataFrame(result_rows(self, read_results(self)))

    def to_xarray(self, *, signals: bool = False) -> "xarray.Dataset":
        """Data set along ``case``: changed inputs and models as coordinates, status, reason and numbers as variables.

        With `signals` it also contains signals along ``time_s`` and, for each case, the bearing's state (healthy or the
        part with the defect), speed, loads and defect size. For a case that was refused, failed or is inaccurate, all
        of these are NaN and the state is empty. Raises `DataError` if sampling rates differ or no case has signals.
        """
        results = read_results(self)
        rows = result_rows(self, results)
        swept = dict.fromkeys(key for case in self.cases for key in case.point)
        units = {name: unit for result in results.values() for name, (_, unit) in result.quantities.items()}
        columns: dict[str, Any] = {name: ("case", [row[name] for row in rows]) for name in ("status", "reason")}
        columns |= {name: ("case", [row.get(name, np.nan) for row in rows], {"units": units[name]}) for name in units}
        coordinates: dict[str, Any] = {key: _coordinate([case.point.get(key) for case in self.cases]) for key in swept}
        coordinates |= {name: ("case", [row[name] for row in rows]) for name in ("case", "model")}
        about = {"campaign": self.campaign.name, "title": self.campaign.title, "version": self.version}
        about |= {"program": f"srbval {__version__}", "use": USE}
        data: xarray.Dataset = require_xarray().Dataset(columns, coordinates, about)
        if not signals:
            return data
        accepted = (case for case in self.cases if case.key in results and works(results[case.key].status))
        return data.merge(_signals_of(self, accepted))


USE = (
    "Every sample is simulated, and amplitudes are not validated: test on measured records before you claim that "
    "something works. Signals of one case are one run: split training and test by case, better by speed or load."
)


def _coordinate(values: Sequence[Any]) -> tuple[str, list[Any], dict[str, str]]:
    """Values of one input of all cases, for xarray: numbers with their common unit, or else texts."""
    found = [number_and_unit(str(value)) for value in values]
    units = {one[1] for one in found if one is not None}
    if None in found or len(units) != 1:
        return "case", ["" if value is None else str(value) for value in values], {}
    return "case", [one[0] for one in found if one is not None], {"units": units.pop() or "1"}


def _signals_of(table: CampaignTable, accepted: Iterable[CampaignCase]) -> "xarray.Dataset":
    """Load the signals, state, speed, loads and defect size of the `accepted` cases; all other cases get NaN."""
    engine, found, rates, labels = require_xarray(), {}, set[float](), dict[str, Any]()
    for case in accepted:
        with engine.open_dataset(result_path(table.folder, case.key), engine="h5netcdf") as file:
            if "time_s" not in file:
                continue
            one = file[[name for name, variable in file.items() if variable.dims == ("time_s",)]].load()
        defect = json.loads(one.attrs["scene"])["defect"]
        labels = {name: one.attrs[name] for name in ("state", "shaft_speed_hz", "radial_n", "axial_n")}
        faulty = labels["state"] != Fault.HEALTHY
        labels |= {f"defect_{name}": (defect[name] or 0.0) if faulty else 0.0 for name in ("height_m", "extent_m")}
        rates.add(float(one.attrs["fs_hz"]))
        found[case.index] = one.drop_attrs(deep=False).assign_coords(labels)
    if not found:
        advice = 'Run the campaign with outputs = ["acceleration"], or use to_xarray(signals=False).'
        raise DataError(f"{table.folder}: no case with the status {' or '.join(WORKING)} has stored signals. {advice}")
    if len(rates) > 1:
        listed = ", ".join(f"{hz:g}" for hz in rates)
        raise DataError(f"{table.folder}: cases differ in output_rate ({listed} Hz). Use to_xarray(signals=False).")
    number = pd.Index(found, name="case")
    joined = engine.concat(found.values(), number, join="outer", coords=list(labels), compat="equals")
    cases = [case.index for case in table.cases]
    signals: xarray.Dataset = joined.assign_coords(fs_hz=rates.pop()).reindex(case=cases, fill_value={"state": ""})
    return signals


def result_path(folder: Path, key: str) -> Path:
    """Path of the result file of the case `key`."""
    return folder / RESULTS_FOLDER / f"{key}.h5"


def write_campaign_table(table: CampaignTable) -> None:
    """Write the table of cases to its folder and remove half-written files; call it with the folder locked.

    Raises `ConfigurationError` if the folder contains files of another campaign, `DataError` if it cannot be written.
    """
    folder, name = table.folder, table.campaign.name
    file = folder / CAMPAIGN_JSON
    own = file.is_file() and file.read_bytes().startswith(f'{{"campaign": {{"name": "{name}"'.encode())
    if not own and any(os.path.lexists(path) for path in (file, folder / RESULTS_CSV)):
        raise ConfigurationError(
            f"{folder}: its {CAMPAIGN_JSON} or {RESULTS_CSV} belongs to another campaign than {name!r}; nothing was "
            "changed. Choose another -o; or, if these are damaged files of this campaign, delete both and "
            "run it again: the results of its cases are kept."
        )
    with atomic_write(file) as part:
        part.write_bytes(json.dumps(to_json(table)).encode())
        append_checksum(part)
    remove_incomplete(folder)


def remove_incomplete(folder: Path) -> None:
    """Remove the half-written files of killed processes; call it with the folder locked."""
    remove_unfinished(folder, {CAMPAIGN_JSON, RESULTS_CSV}.__contains__)
    remove_unfinished(folder / RESULTS_FOLDER, lambda name: name.endswith(".h5"))


def read_campaign_table(folder: Path) -> CampaignTable:
    """Read the table of cases; raises `DataError` if it is missing or damaged."""
    file, again = folder / CAMPAIGN_JSON, f"srbval campaign run FILE.toml -o {folder}"
    if not os.path.lexists(file):
        raise DataError(f"{folder}: contains no campaign. Start one: {again}")
    try:
        if not file.is_file() or checked_summary(file) is None:
            raise ValueError("it has no checksum")
        return replace(build(CampaignTable, parse_json(file.read_bytes()[:-FOOTER_BYTES]), "table"), folder=folder)
    except (OSError, ValueError, SrbvalError) as error:
        why = str(error).removeprefix(f"{file}: ")
        raise DataError(f"{file}: damaged ({why}). To repair it and keep the results: {again}") from None


def case_numbers(sources: Sequence[Any]) -> dict[str, float]:
    """Number of each case, by the path of its result file; empty unless `sources` contains only a campaign's folder."""
    folder = Path(sources[0]) if len(sources) == 1 and isinstance(sources[0], str | Path) else None
    if folder is None or not (folder / CAMPAIGN_JSON).is_file():
        return {}
    return {str(result_path(folder, case.key)): float(case.index) for case in read_campaign_table(folder).cases}


def read_results(table: CampaignTable) -> dict[str, CaseResult]:
    """Read the intact results, by key; a refused case, which has no file, gets a result with the reason."""
    refused = (CaseResult(key=one.key, status=REFUSED, reason=one.refused) for one in table.cases if one.refused)
    stored = (read_intact_result(result_path(table.folder, one.key)) for one in table.cases if not one.refused)
    return {result.key: result for result in (*refused, *stored) if result is not None}


def summarise_campaign(table: CampaignTable, results: Mapping[str, CaseResult]) -> dict[str, Any]:
    """Count the `cases`, those with a result (`done`) and those of each status; list failed and inaccurate cases.

    `failed` cases have no numbers; the numbers of `inaccurate` cases have time-step errors above the tolerances.
    """
    rows = [row for row in result_rows(table, results) if row["status"] != NO_RESULT]
    entries = [{name: row[name] for name in ("case", "key", "status", "reason")} for row in rows]
    return {
        "name": table.campaign.name,
        "cases": len(table.cases),
        "done": len(entries),
        "statuses": dict(Counter(entry["status"] for entry in entries)),
        "failed": [entry for entry in entries if entry["status"] not in USABLE],
        "inaccurate": [entry for entry in entries if entry["status"] == RunStatus.INACCURATE],
    }


def write_results(table: CampaignTable, results: Mapping[str, CaseResult]) -> Path:
    """Write the results as CSV, one row per case and one column per quantity; returns the path.

    Names of quantities end with their SI unit if they have one. A failed case has no quantities; a case without an
    intact result has no row. The same results give the same text. Raises `DataError` if the file cannot be written.
    """
    frame, path = pd.DataFrame(result_rows(table, results), dtype=object), table.folder / RESULTS_CSV
    with atomic_write(path) as part:
        frame[frame["status"] != NO_RESULT].to_csv(part, index=False, errors="replace")
    return path


def result_rows(table: CampaignTable, results: Mapping[str, CaseResult]) -> list[dict[str, Any]]:
    """One mapping per case: inputs, model, status, reason, numbers; status ``missing`` if there is no intact result."""
    rows, swept = [], dict.fromkeys(key for case in table.cases for key in case.point)
    for case in table.cases:
        result = results.get(case.key) or CaseResult(key=case.key, status=NO_RESULT, reason="run the campaign again")
        about = {"case": case.index, "key": case.key, **swept, **case.point, "model": case.model}
        about |= {"status": result.status, "reason": "" if result.status == "ok" else result.reason}
        rows.append(about | {name: value for name, (value, _) in result.quantities.items()})
    return rows


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Lock `folder` for this process; the system releases the lock when the process ends for any reason.

    Raises `ConfigurationError` if another process has locked it, `DataError` if the folder cannot be written.
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
            f"{folder}: cannot be written ({error.strerror}). Choose another -o, or make this one writable."
        ) from None
    with acquired:
        yield


def load_campaign(name: str | Path) -> Campaign | CampaignTable:
    """Load a campaign from a file, a preset by its name, or the folder of an earlier run with its results.

    Raises `DataError` for a missing or damaged file, `ConfigurationError` for an unknown key or an impossible value.
    """
    return read_campaign_table(Path(name)) if (Path(name) / CAMPAIGN_JSON).is_file() else campaign_of(str(name))


def campaign_status(path: str | Path) -> dict[str, Any]:
    """Summarise the campaign in the folder `path` and rewrite its results table.

    Returns the content that ``srbval campaign status --json`` prints. Cases with damaged results are not `done`;
    `table` is None if the results table cannot be written. Raises `DataError` if there is no intact table of cases.
    """
    path = Path(path)
    table = read_campaign_table(path)
    results, written, running = read_results(table), None, False
    with contextlib.suppress(DataError):  # the folder may be read-only
        written = write_results(table, results)
        try:
            with folder_lock(path):
                pass
        except ConfigurationError:
            running = True
    return summarise_campaign(table, results) | {"running": running, "table": written}


def verify_campaign(path: str | Path) -> dict[str, Any]:
    """Check the table of cases and all result files in the folder `path` against their checksums; changes nothing.

    Returns the content that ``srbval campaign verify --json`` prints: `ok` if no file is `damaged` (list of `file` and
    `why`), and the number of `results` that were read. Raises `DataError` if there is no campaign.
    """
    path = Path(path)
    results, damaged = sorted((path / RESULTS_FOLDER).glob("*.h5")), []
    for file in (path / CAMPAIGN_JSON, *results):
        try:
            read_campaign_table(path) if file.name == CAMPAIGN_JSON else read_case_result(file)
        except DataError as error:
            if not os.path.lexists(file):
                raise
            damaged.append({"file": file, "why": str(error).removeprefix(f"{file}: ")})
    return {"ok": not damaged, "results": len(results), "damaged": damaged}


ALMOST_DONE = 0.999  # largest share reported while cases run: rounding must not report the task as done
MESSAGES = 10  # messages about failed cases during the run; the summary lists all


def run_campaign(
    campaign: Campaign | CampaignTable | str | Path,
    path: str | Path,
    *,
    engine: Any = LOCAL,
    progress: Progress = silent,
    message: Callable[[str], None] = lambda _: None,
) -> dict[str, Any]:
    """Run all cases that have no result yet, longest first, and write the results table in the folder `path`.

    `campaign` may also be a file, preset or folder (see `load_campaign`). A failed case has a result with the reason; a
    case whose process died is run again the next time. `engine` is an engine, or the first argument of `choose_engine`.
    `progress` is called with the share of the planned times of the cases that is done, `message` with a line about each
    of the first cases that fail.

    Returns the dictionary of `summarise_campaign` with four more keys: the name of the `engine`, the number of cases
    that this call ran (`ran`), its wall time [s] (`wall_s`) and the path of the CSV file (`table`). Raises
    `ConfigurationError` for a folder in use or with another campaign, `DataError` if it cannot be written or is full.
    """
    started, folder = time.perf_counter(), Path(path).resolve()
    campaign = load_campaign(campaign) if isinstance(campaign, str | Path) else campaign
    campaign = campaign.campaign if isinstance(campaign, CampaignTable) else campaign
    engine = engine if isinstance(engine, Engine) else choose_engine(engine)
    version = content_version(COMPUTED_BY)
    table = CampaignTable(campaign=campaign, version=version, cases=tuple(plan_cases(campaign)), folder=folder)
    with folder_lock(folder):
        write_campaign_table(table)
        results = {key: result for key, result in read_results(table).items() if result.final}
        missing = {case.key: case for case in table.cases if case.key not in results}
        ran = _run_missing(table, missing, engine, progress, message) if missing else {}
        return summarise_campaign(table, results | ran) | {
            "engine": engine.name,
            "ran": len(ran),
            "wall_s": time.perf_counter() - started,
            "table": write_results(table, results | ran),
        }


def _run_missing(
    table: CampaignTable,
    missing: Mapping[str, CampaignCase],
    engine: Engine,
    progress: Progress,
    message: Callable[[str], None],
) -> dict[str, CaseResult]:
    """Run the `missing` cases, the longest first, and return their results by key."""
    longest_first = sorted(missing.values(), key=lambda case: -case.planned_s)
    needed, free = sum(case.expected_bytes for case in longest_first), shutil.disk_usage(table.folder).free
    if needed > free:
        raise DataError(
            f"{table.folder}: {len(missing)} results will take {needed / 1e6:,.1f} MB, {free / 1e6:,.1f} MB are free. "
            "Free some space, choose another -o, or ask for fewer outputs."
        )
    name, total_s = f"campaign {table.campaign.name}, {len(missing)} cases", sum(c.planned_s for c in longest_first)
    ran, ended_s, failed = dict[str, CaseResult](), 0.0, 0
    progress(name, 0.0)
    try:
        with contextlib.closing(engine.run(_make_task(table, case, progress) for case in longest_first)) as results:
            for result in results:
                case, ran[result.key] = missing[result.key], result
                ended_s += case.planned_s
                progress(name, 1.0 if len(ran) == len(missing) else min(ended_s / total_s, ALMOST_DONE))
                if not result.usable and (failed := failed + 1) <= MESSAGES:
                    message(f"case {case.index} {result.status}: {result.reason}")
    except DataError as error:
        kept = f"{len(ran)} of {len(missing)} cases of this run are done and kept; the same command runs the rest."
        raise DataError(f"{error} {kept}") from None
    finally:
        remove_incomplete(table.folder)  # files of processes that were ended while writing
    return ran


def _make_task(table: CampaignTable, case: CampaignCase, progress: Progress) -> CaseTask:
    campaign = table.campaign
    scene = replace(scene_of_point(campaign, case.point), model=case.model)
    compile_for(scene, progress=progress)
    limit_s = max(campaign.least_limit_s, campaign.limit_factor * case.planned_s) if campaign.limit_factor else None
    return CaseTask(
        key=case.key,
        version=table.version,
        scene=scene,
        outputs=campaign.outputs,
        path=result_path(table.folder, case.key),
        limit_s=limit_s,
    )
