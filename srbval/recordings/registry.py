"""The register of recordings: functions of the commands `srbval data add`, `list`, `fetch` etc., and searches in it."""

import contextlib
import logging
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.bearing import Fault, load_bearing
from srbval.errors import DataError
from srbval.models.run import Run
from srbval.progress import Progress, silent
from srbval.recordings.datasets.description import dataset, known_datasets
from srbval.recordings.load import load_recording, recording_from_run, with_settings
from srbval.recordings.loaders import end_readers
from srbval.recordings.manifest import (
    CAMPAIGN_JSON,
    RESULTS_FOLDER,
    EntriesByFile,
    FileStatus,
    RegisteredRecording,
    home_folder,
    inspect_file,
    is_unchanged,
    read_manifest,
    update_manifest,
    without_copies,
)
from srbval.recordings.raw import first_line
from srbval.recordings.reading import N_PER_KN, scaled
from srbval.recordings.recording import Origin, Recording
from srbval.recordings.settings import RecordingSettings, label_table, settings_of
from srbval.recordings.speed import RPM_PER_HZ
from srbval.storage.installation import shipped_folder

MAX_WORKERS = 4
RECORDINGS_VARIABLE = "SRBVAL_RECORDINGS"
RIG_EXCERPTS = "data_manifest/rig_excerpts"  # the folder that comes with the program
TIMEOUT_S = 30
MAX_DOWNLOAD_ERROR_LENGTH = 160
NO_SETTINGS = RecordingSettings()
OUTPUT = {  # what srbval writes beside the main file of a report and of a campaign (a set of simulations)
    "report.html": ("report.html", "report.json", "report.pdf", "figures"),
    CAMPAIGN_JSON: (CAMPAIGN_JSON, "results.csv", "lock", RESULTS_FOLDER),
}
RIG_DATASETS = ("torino-full", "torino-excerpts")  # the longer recordings first
SAME_SPEED = 0.05  # share by which the speeds of a record and its baseline may differ if no set point is known


class RegisterListing:
    """Entries of the register of recordings (all, or those changed by a command), sorted by file.

    `left_out` are files that are not recordings, `problems` recordings whose status is not ok.
    """

    def __init__(self, entries: Iterable[RegisteredRecording]) -> None:
        found = sorted(entries, key=lambda entry: entry.file)
        self.recordings = tuple(r for r in found if r.status is not FileStatus.NO_RECORDING)
        self.left_out = tuple(r for r in found if r.status is FileStatus.NO_RECORDING)
        self.problems = tuple(r for r in self.recordings if r.status is not FileStatus.OK)


def add(
    folder: str | Path,
    *,
    progress: Progress = silent,
    repin: bool = False,
    settings: RecordingSettings | None = None,
    table: str | Path | None = None,
) -> RegisterListing:
    """Register all files in and below `folder` (or a single file); with a CSV `table`, only the files in its rows.

    No file is copied. A file whose SHA-256 differs from its first registration is reported as changed. `settings` are
    stored with each file; settings in the file's row of the table (see `label_table`) take precedence. A setting that
    is not given keeps its stored value. `repin` replaces the stored hash and all stored settings. Files that are not
    recordings are in `left_out` of the listing. Raises `DataError` if no file is a recording, a file in the table is
    not a recording, or the register cannot be written; `ConfigurationError` for an unknown bearing or a wrong table.
    """
    if table is None:
        files = dict.fromkeys(files_under(Path(folder)), settings or NO_SETTINGS)
    else:
        files = label_table(Path(table), Path(folder), settings or NO_SETTINGS)
    for file, given in files.items():
        if (bearing := given.bearing) is not None:  # by its name or absolute path, so that it loads from every folder
            name = load_bearing(bearing).name
            files[file] = replace(given, bearing=os.path.abspath(bearing) if bearing.endswith(".toml") else name)
    known = {} if repin else read_manifest()
    found = RegisterListing(replace(entry, registered=True) for entry in _inspect(files, known, "Register", progress))
    if found.left_out and (table is not None or not found.recordings):
        wrong, first = f"{len(found.left_out)} of {len(files)} files to register", found.left_out[0]
        raise DataError(f"{folder}: {wrong} are no recordings, the first: {first.file}: {first.reason}")
    update_manifest(lambda entries: entries | {entry.file: entry for entry in found.recordings})
    return found


def remove(name: str | Path) -> RegisterListing:
    """Remove the entries of a file or of all files below a folder from the register; `DataError` if there are none."""
    registered = {file: entry for file, entry in read_manifest().items() if entry.registered}
    removed = {file: e for file, e in registered.items() if Path(file).is_relative_to(os.path.abspath(name))}
    if not removed:
        raise DataError(
            f"{name}: nothing was removed, because no registered file or folder has this path. Give a path of `srbval "
            f"data list`. Files listed only because of {RECORDINGS_VARIABLE} are not registered."
        )
    update_manifest(lambda entries: {file: entry for file, entry in entries.items() if file not in removed})
    return RegisterListing(removed.values())


def listing(*, hash_all: bool = False, progress: Progress = silent) -> RegisterListing:
    """Compare files with their entries: registered files, and files in the folder ``$SRBVAL_RECORDINGS``.

    Files are hashed if their size or modification time has changed, or always with `hash_all`.
    """
    known = read_manifest()
    files = [file for file, entry in known.items() if entry.registered]
    if set_by_user := os.environ.get(RECORDINGS_VARIABLE):
        folder = Path(set_by_user).expanduser()
        if not folder.is_dir():
            raise DataError(f"{RECORDINGS_VARIABLE} is {set_by_user!r}, which is not a folder. Correct it or unset it.")
        files += files_under(folder)
    return RegisterListing(_inspect_and_store(files, known, again=hash_all, progress=progress))


def verify_recordings(*, progress: Progress = silent) -> RegisterListing:
    """Hash all registered files again and compare them with their entries."""
    return listing(hash_all=True, progress=progress)


def shipped_recordings() -> tuple[RegisteredRecording, ...]:
    """Entries of the Torino test rig's open recordings, which are installed with the program in compact form."""
    return RegisterListing(_inspect_and_store(files_under(shipped_folder(RIG_EXCERPTS)), read_manifest())).recordings


def fetch(name: str, folder: str | Path | None = None, *, progress: Progress = silent) -> RegisterListing:
    """Download the open data set `name` into `folder` (default: below `home_folder`) and register it."""
    import pooch

    wanted = dataset(name)
    by_hand = f"get the files from {wanted.url} and register their folder with `srbval data add DIR`"
    pinned = [file for file in wanted.files if {"url", "sha256"} <= set(file)]
    if not pinned:
        downloadable = ", ".join(d.name for d in known_datasets() if any("url" in file for file in d.files))
        raise DataError(
            f"{name}: no files to download (licence: {wanted.licence}); {by_hand}. Downloadable: {downloadable}."
        )
    target = Path(folder) if folder is not None else home_folder() / "recordings" / name
    downloader = pooch.HTTPDownloader(timeout=TIMEOUT_S)
    pooch.get_logger().setLevel(logging.WARNING)
    progress("Download", 0.0)
    for done, file in enumerate(pinned, 1):
        url, known = file["url"], f"sha256:{file['sha256']}"
        try:
            pooch.retrieve(url=url, known_hash=known, fname=file["name"], path=target, downloader=downloader)
        except Exception as error:  # the network and its libraries fail in many ways; the remedy is the same
            why = first_line(error, MAX_DOWNLOAD_ERROR_LENGTH)
            raise DataError(
                f"{file['name']} could not be downloaded from {url} ({why}). Try again with a network, or {by_hand}."
            ) from None
        progress("Download", done / len(pinned))
    return add(target)


def files_under(folder: Path) -> list[str]:
    """Files below `folder`, sorted; `DataError` if there are none.

    Hidden files, linked folders and the files of `OUTPUT` are left out. Of a campaign's own folder the result files are
    listed.
    """
    whole = Path(os.path.abspath(folder))
    results = whole / RESULTS_FOLDER
    whole = results if (whole / CAMPAIGN_JSON).is_file() and results.is_dir() else whole
    if whole.is_file():
        return [str(whole)]
    if not whole.is_dir():
        raise DataError(f"{folder}: no such folder. Check the path.")
    paths = [path for path in whole.rglob("*") if "/." not in f"/{path.relative_to(whole).as_posix()}"]
    outputs = {path.parent / name for path in paths for name in OUTPUT.get(path.name, ())}
    found = sorted(path for path in paths if not path.is_dir() and outputs.isdisjoint((path, *path.parents)))
    if not found:
        raise DataError(f"{folder}: contains no files to read. Name the folder of the recordings.")
    return [str(path) for path in found]


def _inspect_and_store(
    files: Iterable[str], known: EntriesByFile, *, again: bool = False, progress: Progress = silent
) -> list[RegisteredRecording]:
    """Entries of `files`; unchanged files with an entry in `known` are read only if `again`. New results are stored."""
    found = _inspect(dict.fromkeys(files, NO_SETTINGS), known, "Verify", progress, again=again)
    usable = (entry for entry in found if entry.sha256 and (entry.status is FileStatus.OK or not entry.registered))
    new = {entry.file: entry for entry in usable if entry != known.get(entry.file)}
    if new:
        with contextlib.suppress(DataError):  # a home that cannot be written costs time, not the recordings
            update_manifest(lambda now: now | {f: e for f, e in new.items() if now.get(f) == known.get(f)})
    return found


def _inspect(
    files: Mapping[str, RecordingSettings], known: EntriesByFile, task: str, progress: Progress, *, again: bool = False
) -> list[RegisteredRecording]:
    """Entries of `files`; without `again`, a `known` entry stays if the file is unchanged and has no new settings."""

    def inspect(file: str) -> RegisteredRecording:
        old, stated = known.get(file), files[file]
        if old and not again and not stated and is_unchanged(old):
            return old
        return inspect_file(Path(file), stated.over((old and old.settings) or NO_SETTINGS), old)

    found: list[RegisteredRecording] = []
    with ThreadPoolExecutor(MAX_WORKERS) as pool:  # hashing and reading release the interpreter's lock
        try:
            for entry in pool.map(inspect, files):
                found.append(entry)
                progress(task, len(found) / len(files))
        except BaseException:  # Ctrl-C does not wait for the files that are being read
            pool.shutdown(wait=False, cancel_futures=True)
            end_readers()
            raise
    return found


def rig_recordings(registered: tuple[RegisteredRecording, ...] | None = None) -> tuple[RegisteredRecording, ...]:
    """Usable recordings of the Torino rig; shipped excerpts only for operating points without another recording."""
    own = [r for r in (listing().recordings if registered is None else registered) if _usable_of_rig(r)]
    points = {r.operating_point for r in own}
    shipped = [r for r in shipped_recordings() if _usable_of_rig(r) and r.operating_point not in points]
    return tuple(sorted(without_copies((*own, *shipped)), key=lambda r: (RIG_DATASETS.index(r.dataset or ""), r.file)))


def _usable_of_rig(entry: RegisteredRecording) -> bool:
    return entry.dataset in RIG_DATASETS and entry.status is FileStatus.OK


def is_unopened(entry: RegisteredRecording) -> bool:
    """True for a usable Torino record if neither file nor operating point was known when the model was developed."""
    excerpts = dataset(RIG_DATASETS[-1])
    opened = {file["sha256"] for file in excerpts.files if "used_for" in file}
    known = entry.sha256 in opened or entry.operating_point in excerpts.operating_points
    return _usable_of_rig(entry) and not known


def healthy_baseline(recording: Recording) -> RegisteredRecording | None:
    """Longest other healthy record of the same rig, sensor, nominal speed, load and sampling rate, or None.

    If the record belongs to no data set, the bearing must be the same and the mean speeds must agree within
    `SAME_SPEED`. A record without a speed has no baseline.
    """
    mean_rpm = None if recording.speed is None else recording.speed.value_hz * RPM_PER_HZ
    rpm = mean_rpm if recording.dataset is None else recording.nominal_rpm
    if recording.file is None or rpm is None:
        return None
    rig, is_simulated = rig_of(recording.dataset, os.path.abspath(recording.file)), recording.origin is Origin.SIMULATED
    conditions = rig, is_simulated, recording.channel, recording.fs_hz, recording.radial_n, recording.axial_n

    def comparable(entry: RegisteredRecording) -> bool:
        loads_n = scaled(entry.radial_kn, N_PER_KN), scaled(entry.axial_kn, N_PER_KN)
        own = rig_of(entry.dataset, entry.file), entry.origin is Origin.SIMULATED, entry.channel, entry.fs_hz, *loads_n
        if own != conditions:
            return False
        if recording.dataset is not None:
            return entry.nominal_rpm == rpm
        return entry.bearing == recording.bearing and abs((entry.rpm or 0.0) / rpm - 1) <= SAME_SPEED

    usable = (r for r in (*listing().recordings, *shipped_recordings()) if r.status is FileStatus.OK)
    healthy = (r for r in usable if r.state is Fault.HEALTHY and r.sha256 != recording.sha256 and comparable(r))
    return max(healthy, key=lambda entry: entry.seconds or 0.0, default=None)


def rig_of(dataset: str | None, file: str) -> tuple[str | None, str]:
    """Data set and folder that identify a record's machine; the folder is empty if the data set has one machine."""
    if dataset in RIG_DATASETS:
        return RIG_DATASETS[0], ""
    per_folder = dataset is None or any(d.name == dataset and d.one_rig_a_folder for d in known_datasets())
    return dataset, str(Path(file).parent) if per_folder else ""


def load_entry(entry: RegisteredRecording) -> Recording:
    """Load a registered recording with its stored settings; raises the errors of `load_recording`."""
    return load_recording(entry.file, entry.settings)


RecordSource = str | Path | Recording | Run  # a record's file, itself, or a simulated run


def files_of(path: str | Path) -> list[str]:
    """List the named file, or all files below the named folder."""
    return files_under(Path(path)) if Path(path).is_dir() else [str(find_shipped(path))]


def recording_of(source: RecordSource, settings: RecordingSettings | None = None, **stated: Any) -> Recording:
    """Return the recording of a file or a run, or `source` itself, after applying the user's settings.

    `stated` are fields of `RecordingSettings`: `channel`, sampling rate `fs_hz`, `unit` of the samples in the file (see
    `units.UNITS`), mean shaft speed `rpm` and, if the speed is a set point, `rpm_tolerance_pct`. If several sources
    state a fact, the first of these is used: `stated`, `settings`, the register (`registered_settings`), the file.
    Raises `DataError` for a file that cannot be read or is ambiguous, `ConfigurationError` for an impossible setting.
    """
    settings = settings_of(stated).over(settings or NO_SETTINGS)
    if isinstance(source, str | Path):
        path = find_shipped(source)
        return load_recording(path, registered_settings(path, settings))
    return with_settings(recording_from_run(source) if isinstance(source, Run) else source, settings)


def find_shipped(name: str | Path) -> str | Path:
    """Path of the shipped recording called `name`; `name` itself if there is none, or if a file of this name exists."""
    shipped = shipped_folder(RIG_EXCERPTS) / name
    return shipped if not Path(name).exists() and Path(name).name == str(name) and shipped.is_file() else name


def registered_settings(
    path: str | Path, settings: RecordingSettings | None = None, band_hz: tuple[float, float] | None = None
) -> RecordingSettings:
    """Merge `settings` with the settings stored in the register for this file; `settings` take precedence.

    If the settings request resampling, `band_hz`, the band of the analysis, replaces the stored band.
    """
    entry = read_manifest().get(os.path.abspath(path))
    merged = (settings or NO_SETTINGS).over((entry and entry.settings) or NO_SETTINGS)
    return replace(merged, band_hz=band_hz, auto_band=None) if band_hz and merged.resample_hz else merged
