"""The register itself: `srbval data add`, `list` and `verify`."""

import contextlib
import os
from collections.abc import Iterable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from srbval.bearing import known_bearings, load_bearing
from srbval.errors import DataError
from srbval.progress import Progress, silent
from srbval.recordings.load import sha256_of
from srbval.recordings.loaders.limited import end_readers
from srbval.recordings.registry.entry import FileStatus, RegisteredRecording, RegisterListing, coverage_of
from srbval.recordings.registry.inspect import inspect_file
from srbval.recordings.registry.label_table import label_table
from srbval.recordings.registry.manifest import Entries, inspected_path, manifest_path, read_manifest, update_manifest
from srbval.recordings.settings import RecordingSettings
from srbval.storage.installation import shipped_folder

MAX_WORKERS = 4
RECORDINGS_VARIABLE = "SRBVAL_RECORDINGS"
RIG_EXCERPTS = "data_manifest/rig_excerpts"  # the folder that comes with the program


def add(
    folder: str | Path,
    *,
    progress: Progress = silent,
    repin: bool = False,
    settings: RecordingSettings | None = None,
    table: str | Path | None = None,
) -> RegisterListing:
    """Register every file under `folder` (or one file), or those that a `table` of labels names; nothing is copied.

    A file registered for the first time is pinned with its SHA-256; one that differs from its pin is reported as
    changed and keeps the pin, unless `repin`. `settings` are stored for each of the files and used whenever one is
    loaded; without any, those stored before stay (`repin` deletes them). A file that was registered elsewhere and no
    longer exists there has moved: its old entry is removed, its settings stay (except with `repin`). Files that are no
    recording stay in the list with a reason. `progress` is the share of the bytes.
    What a row of the table (see `label_table`) says of its file goes over `settings`.
    Raises `DataError` for a folder that does not exist or a manifest that cannot be written, `ConfigurationError` for a
    bearing that is not known or a table that cannot be used.
    """
    files: Mapping[Path, RecordingSettings | None]
    if table is None:
        files = dict.fromkeys(_files_under(Path(folder)), settings)
    else:
        files = label_table(Path(table), Path(folder), settings or RecordingSettings())
    files = {file: stated and _with_bearing(stated) for file, stated in files.items()}
    registered = read_manifest()
    known = {} if repin else registered
    gone = [e for e in registered.values() if e.sha256 and not os.path.exists(e.file)]
    found = _inspect(files, known, progress)
    for i, entry in enumerate(found if not repin else ()):
        former = next((old.settings for old in gone if old.sha256 == entry.sha256 and old.settings), None)
        if former is not None and entry.file not in known:
            found[i] = inspect_file(Path(entry.file), entry.settings.over(former) if entry.settings else former)
    present = {entry.sha256 for entry in found}

    def change(entries: Entries) -> None:
        for old in gone:
            if old.sha256 in present:
                entries.pop(old.file, None)
        entries |= {e.file: e if repin else _compared_with_pin(entries.get(e.file), e) for e in found}

    entries = update_manifest(change)
    return _listing(entries[entry.file] for entry in found)


def listing(*, or_none: bool = False) -> RegisterListing:
    """All registered files with their status from size and time of change, without hashing them.

    Files of the folder that SRBVAL_RECORDINGS names are included whether registered or not. With `or_none` a register
    that cannot be read counts as empty, and the listing says why in `unreadable`.
    """
    registered, unreadable = {}, ""
    try:
        registered = read_manifest()
    except DataError as error:
        if not or_none:
            raise
        unreadable = str(error).removeprefix(f"{manifest_path().parent}{os.sep}")
    entries = _with_environment_folder(registered)
    return _listing((e if _unchanged(e) else _verified(e) for e in entries.values()), unreadable)


def verify(*, progress: Progress = silent) -> RegisterListing:
    """All registered files, each hashed again and compared with its pin."""
    entries = _with_environment_folder(read_manifest())
    total, done, checked = sum(e.size_bytes for e in entries.values()), 0, []
    for entry in entries.values():
        checked.append(_verified(entry))
        done += entry.size_bytes
        progress("Verify", done / max(total, 1))
    return _listing(checked)


def shipped_recordings() -> tuple[RegisteredRecording, ...]:
    """The rig's open excerpts that come with the program, in compact form; their folder says where they come from."""
    return tuple(_look_at(shipped_folder(RIG_EXCERPTS), {}, pinned=False).values())


def _listing(entries: Iterable[RegisteredRecording], unreadable: str = "") -> RegisterListing:
    recordings = tuple(sorted(entries, key=lambda e: e.file))
    coverage = coverage_of(recordings)
    return RegisterListing(manifest=manifest_path(), recordings=recordings, coverage=coverage, unreadable=unreadable)


def _files_under(folder: Path) -> list[Path]:
    """Regular files below `folder`, sorted; hidden ones and links to folders are skipped."""
    if folder.is_file():
        return [Path(os.path.abspath(folder))]
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder. Check the path.")
    found = []
    for parent, folders, names in os.walk(os.path.abspath(folder)):
        folders[:] = [name for name in folders if not name.startswith(".")]
        found += [Path(parent, name) for name in names if not name.startswith(".")]
    if not found:
        raise DataError(f"{folder}: holds no file. Name the folder that holds the recordings.")
    return sorted(found)


def _with_bearing(settings: RecordingSettings) -> RecordingSettings:
    """The settings with a bearing that can be loaded, from whatever folder: a file by its whole path."""
    if settings.bearing is None:
        return settings
    name = load_bearing(settings.bearing).name
    return replace(settings, bearing=name if name in known_bearings() else os.path.abspath(settings.bearing))


def _inspect(
    files: Mapping[Path, RecordingSettings | None], known: Entries, progress: Progress
) -> list[RegisteredRecording]:
    """Every file inspected; one whose size and time of change are those pinned is taken from `known`.

    Settings that are given override those stored for a file.
    """
    sizes = [_size_and_time(path)[0] for path in files]
    total, done, found = sum(sizes), 0, []

    def inspect(path: Path) -> RegisteredRecording:
        pinned, settings = known.get(str(path)), files[path]
        if pinned and not settings and _unchanged(pinned) and not (pinned.channels and pinned.cautions is None):
            return pinned
        stored = (pinned and pinned.settings) or RecordingSettings()
        return inspect_file(path, settings.over(stored) if settings else stored)

    with ThreadPoolExecutor(min(MAX_WORKERS, os.cpu_count() or 1)) as pool:  # hashing and reading release the GIL
        try:
            for entry, size in zip(pool.map(inspect, files), sizes, strict=True):
                found.append(entry)
                done += size
                progress("Register", done / max(total, 1))
        except BaseException:  # Ctrl-C does not wait for the files that are being read
            pool.shutdown(wait=False, cancel_futures=True)
            end_readers()
            raise
    return found


def _size_and_time(path: str | Path) -> tuple[int, int]:
    """Size [bytes] and time of change [ns]; 0 and -1 for a file that cannot be seen."""
    try:
        found = os.stat(path)
    except OSError:
        return 0, -1
    return found.st_size, found.st_mtime_ns


def _unchanged(entry: RegisteredRecording) -> bool:
    return _size_and_time(entry.file) == (entry.size_bytes, entry.mtime_ns)


def _compared_with_pin(pinned: RegisteredRecording | None, found: RegisteredRecording) -> RegisteredRecording:
    """The entry for the register: the pin stays, and a file that differs from it is marked."""
    return found if pinned is None or pinned.sha256 == found.sha256 else _changed(pinned, found.sha256)


def _changed(pinned: RegisteredRecording, sha256: str) -> RegisteredRecording:
    return pinned.with_status(
        FileStatus.CHANGED,
        f"SHA-256 was {pinned.sha256[:12]}... when registered and is {sha256[:12]}... now; restore the file, "
        "or register it again if it was changed on purpose (`srbval data add --repin`)",
    )


def _verified(entry: RegisteredRecording) -> RegisteredRecording:
    path = Path(entry.file)
    if not path.exists():
        return entry.with_status(FileStatus.MISSING, "the file is no longer there")
    size, _ = _size_and_time(path)
    if size < entry.size_bytes:
        return entry.with_status(
            FileStatus.TRUNCATED, f"{size} bytes where {entry.size_bytes} were registered; copy the file again"
        )
    try:
        sha256 = sha256_of(path) if entry.sha256 else ""  # without one it could not even be hashed
    except DataError as error:
        return entry.with_status(FileStatus.UNREADABLE, str(error))
    if sha256 != entry.sha256:
        return _changed(entry, sha256)
    return inspect_file(path, entry.settings) if entry.status is FileStatus.CHANGED or not sha256 else entry


def _with_environment_folder(entries: Entries) -> Entries:
    """Add the files of the folder that SRBVAL_RECORDINGS names, for as long as it does."""
    set_by_user = os.environ.get(RECORDINGS_VARIABLE)
    if not set_by_user:
        return entries
    folder = Path(set_by_user).expanduser()
    if not folder.is_dir():
        raise DataError(f"{RECORDINGS_VARIABLE} is {set_by_user!r}, which is not a folder. Correct it or unset it.")
    return {**entries, **_look_at(folder, entries)}


def _look_at(folder: Path, entries: Entries, *, pinned: bool = True) -> Entries:
    """The files of a folder that is used without being registered; where `pinned`, those that changed since are marked.

    The results of their inspection are stored apart from the register, so that they are not read again each time.
    """
    store = inspected_path()
    try:
        known = {key: entry for key, entry in read_manifest(store).items() if os.path.exists(key)}
    except DataError:  # it cannot be read: the files are inspected again
        known = {}
        with contextlib.suppress(OSError):
            store.unlink()
    known |= entries
    inspected = _inspect(dict.fromkeys(_files_under(folder)), known, silent)
    found = {e.file: _compared_with_pin(known.get(e.file), e) if pinned else e for e in inspected}

    def change(stored: Entries) -> None:
        for key in [key for key in stored if not os.path.exists(key)]:
            del stored[key]
        stored.update((key, entry) for key, entry in found.items() if key not in entries)

    if any(entry != known.get(key) for key, entry in found.items()):
        with contextlib.suppress(DataError):  # a home that cannot be written costs time, not the recordings
            update_manifest(change, store)
    return found
