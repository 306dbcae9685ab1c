"""The register itself: `srbval data add`, `list`, `verify`, `remove` and `fetch`."""

import contextlib
import logging
import os
import stat
from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

from srbval.bearing import known_bearings, load_bearing
from srbval.errors import ConfigurationError, DataError, NoRecordingError, SrbvalError
from srbval.progress import Progress, silent
from srbval.recordings.datasets.description import dataset, known_datasets
from srbval.recordings.load import read_file
from srbval.recordings.loaders import detect_format
from srbval.recordings.loaders.limited import end_readers
from srbval.recordings.raw import first_line
from srbval.recordings.reading import N_PER_KN
from srbval.recordings.registry.manifest import (
    Entries,
    FileStatus,
    RegisteredRecording,
    RegisterListing,
    home_folder,
    inspected_path,
    manifest_path,
    read_manifest,
    update_manifest,
)
from srbval.recordings.settings import RecordingSettings, apply_settings, label_table, open_for_analysis, open_questions
from srbval.recordings.speed import RPM_PER_HZ
from srbval.storage.files import file_sha256
from srbval.storage.installation import shipped_folder

MAX_WORKERS = 4
RECORDINGS_VARIABLE = "SRBVAL_RECORDINGS"
RIG_EXCERPTS = "data_manifest/rig_excerpts"  # the folder that comes with the program
TIMEOUT_S = 30
LONGEST_REASON = 160
HEAD_BYTES = 1000
# What srbval itself writes: the file that shows it, what it is, and the names of all that belongs to it in that folder.
REPORT = {"report.html", "report.pdf", "report.json", "appendix.html", "appendix.pdf", "figures"}
CAMPAIGN = {"srbval-campaign.json", "results.csv", "lock", "cases"}
GENERATOR = b'<meta name="generator" content="srbval'
OWN_OUTPUT = (
    ("report.html", GENERATOR, "report", REPORT),
    ("srbval-campaign.json", b'"campaign"', "campaign", CAMPAIGN),
)


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
    recording, reports and campaigns of srbval among them, are not registered; the listing has them as `left_out`.
    `progress` is the share of the bytes. What a row of the table (see `label_table`) says of its file goes over
    `settings`. Raises `DataError` for a folder that does not exist or holds no recording, a file that is named and is
    none, or a manifest that cannot be written, `ConfigurationError` for a bearing that is not known or a table that
    cannot be used.
    """
    files: Mapping[Path, RecordingSettings | None]
    if table is None:
        files = dict.fromkeys(files_under(Path(folder)), settings)
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
    no_recordings = (entry for entry in found if entry.status is FileStatus.NO_RECORDING)
    others = [entry for entry in no_recordings if known.get(entry.file, entry).sha256 == entry.sha256]
    if others and (len(others) == len(found) or table is not None):
        raise DataError(
            f"{folder}: {len(others)} of {len(found)} files to register are no recordings; {others[0].file}: "
            f"{others[0].reason}"
        )

    def change(entries: Entries) -> None:
        for old in gone:
            if old.sha256 in present:
                entries.pop(old.file, None)
        entries |= {e.file: e if repin else _compared_with_pin(entries.get(e.file), e) for e in found}
        for other in others:
            del entries[other.file]

    entries = update_manifest(change)
    return RegisterListing(entries.get(entry.file, entry) for entry in found)


def remove(name: str | Path) -> RegisterListing:
    """Take out of the register what `name` means, and return it; the files themselves stay as they are.

    A file, a folder with all below it, a data set, or the name of one file. Raises `DataError` where nothing of that
    name is registered, `ConfigurationError` where files in several folders have it.
    """
    path, wanted = os.path.abspath(name), str(name)
    removed: list[RegisteredRecording] = []

    def change(entries: Entries) -> None:
        every = list(entries.values())
        named = [entry for entry in every if Path(entry.file).name == wanted]
        removed[:] = (
            [entry for entry in every if entry.file == path or entry.file.startswith(os.path.join(path, ""))]
            or [entry for entry in every if entry.dataset == wanted]
            or named
        )
        if not removed:
            raise DataError(
                f"{wanted}: no registered file, folder or data set; nothing was removed. See: srbval data list. What "
                f"{RECORDINGS_VARIABLE} names is listed as long as that is set."
            )
        if removed == named and len(named) > 1:
            files = ", ".join(entry.file for entry in named)
            raise ConfigurationError(f"{wanted}: the name of {len(named)} registered files; give the path: {files}.")
        for entry in removed:
            del entries[entry.file]

    update_manifest(change)
    return RegisterListing(removed)


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
    return RegisterListing((e if _unchanged(e) else _verified(e) for e in entries.values()), unreadable)


def verify(*, progress: Progress = silent) -> RegisterListing:
    """All registered files, each hashed again and compared with its pin."""
    entries = _with_environment_folder(read_manifest())
    total, done, checked = sum(e.size_bytes for e in entries.values()), 0, []
    for entry in entries.values():
        checked.append(_verified(entry))
        done += entry.size_bytes
        progress("Verify", done / max(total, 1))
    return RegisterListing(checked)


def fetch(name: str, folder: str | Path | None = None, *, progress: Progress = silent) -> RegisterListing:
    """Download the open data set `name` into `folder` (default: below the home folder) and register it.

    Files that exist with the right SHA-256 are kept, so an interrupted download continues where it
    stopped. `progress` is the share of the files. Raises `DataError` for a set that is restricted or has no pinned
    files, and without a network, each with the remedy.
    """
    import pooch

    wanted = dataset(name)
    if wanted.access != "open":
        raise DataError(f"{wanted.name}: no download; {wanted.licence}. {wanted.source}.")
    by_hand = f"{wanted.url} and register"
    pinned = [file for file in wanted.files if file.url and file.sha256]
    if not pinned:
        downloadable = ", ".join(d.name for d in known_datasets() if any(f.url and f.sha256 for f in d.files))
        raise DataError(
            f"{wanted.name}: no pinned files to download. Get it from {by_hand} its folder with `srbval data add DIR`. "
            f"Downloadable: {downloadable}."
        )
    target = Path(folder) if folder is not None else home_folder() / "recordings" / name
    downloader = pooch.HTTPDownloader(timeout=TIMEOUT_S)
    pooch.get_logger().setLevel(logging.WARNING)
    progress("Download", 0.0)
    for done, file in enumerate(pinned, 1):
        known = f"sha256:{file.sha256}"
        try:
            pooch.retrieve(url=file.url, known_hash=known, fname=file.name, path=target, downloader=downloader)
        except Exception as error:  # the network and its libraries fail in many ways; the remedy is the same
            raise DataError(
                f"{file.name} could not be downloaded from {file.url} ({first_line(error, LONGEST_REASON)}). Try again "
                f"with a network, or get the files from {by_hand} their folder with `srbval data add DIR`."
            ) from None
        progress("Download", done / len(pinned))
    return add(target)


def shipped_recordings() -> tuple[RegisteredRecording, ...]:
    """The rig's open excerpts that come with the program, in compact form; their folder says where they come from."""
    return tuple(_look_at(shipped_folder(RIG_EXCERPTS), {}, pinned=False).values())


def inspect_file(path: Path, settings: RecordingSettings | None = None) -> RegisteredRecording:
    """Hash and read `path`; whatever is wrong becomes a status with a reason.

    `settings` decide what the file leaves open; one that does not fit it, as a channel that is not there, is ignored
    and reported. A file that still leaves something open is ok, with all questions and their options as its reason.
    """
    entry = RegisteredRecording(file=str(path), sha256="", size_bytes=0, mtime_ns=0, status=FileStatus.OK)
    try:
        found = path.stat()
        if not stat.S_ISREG(found.st_mode):
            return entry.with_status(FileStatus.UNREADABLE, "not a regular file")
        if output := _own_output(path):
            return entry.with_status(FileStatus.NO_RECORDING, output)
        sha256 = file_sha256(path)
        entry = replace(entry, size_bytes=found.st_size, mtime_ns=found.st_mtime_ns, sha256=sha256)
        entry = replace(entry, format=detect_format(path).name)
        entry = _described(entry, path, settings or RecordingSettings())
    except OSError as error:
        return entry.with_status(FileStatus.UNREADABLE, f"cannot be read ({error.strerror})")
    except SrbvalError as error:
        text = str(error).removeprefix(f"{path}: ")
        if isinstance(error, NoRecordingError):
            return entry.with_status(FileStatus.NO_RECORDING, text)
        cut = "truncated: " in text or "truncated file" in text  # as the loaders and the HDF5 library say it
        return entry.with_status(FileStatus.TRUNCATED if cut else FileStatus.UNREADABLE, text)
    expected = (file for d in known_datasets() if d.name == entry.dataset for file in d.files)
    published = next((file.sha256 for file in expected if file.name == path.name and file.sha256), sha256)
    if published != sha256:
        return entry.with_status(FileStatus.CHANGED, f"its SHA-256 is not the published {published[:12]}...")
    return entry


def _own_output(path: Path) -> str | None:
    """Of which report or campaign a file is a part, None for any other."""
    for folder in path.parents[:2]:
        for shown_by, content, what, parts in OWN_OUTPUT:
            if path.relative_to(folder).parts[0] in parts and content in _head(folder / shown_by):
                return f"part of a {what} that srbval wrote, {folder}"
    return None


def _head(path: Path) -> bytes:
    try:
        with path.open("rb") as file:
            return file.read(HEAD_BYTES)
    except OSError:
        return b""


def _described(entry: RegisteredRecording, path: Path, settings: RecordingSettings) -> RegisteredRecording:
    file, wrong = read_file(path), []
    try:
        reading = apply_settings(path, file, settings)
    except DataError:  # one by one, to keep those that fit
        stated, settings = settings, RecordingSettings()
        for name, value in vars(stated).items():
            try:
                apply_settings(path, file, replace(settings, **{name: value}))
                settings = replace(settings, **{name: value})
            except DataError as error:
                wrong.append(str(error).removeprefix(f"{path}: "))
        reading = apply_settings(path, file, settings)
    if questions := (*open_questions(reading), *open_for_analysis(reading)):
        wrong.append(f"not stated: {'; '.join(map(str, questions))}")
    names = tuple(reading.channels)
    main = reading.channels[reading.channel or (reading.axes or names)[0]]
    return replace(
        entry,
        reason="; ".join(wrong) or None,
        origin=reading.origin,
        dataset=reading.dataset,
        state=main.state,
        radial_kn=None if reading.radial_n is None else reading.radial_n / N_PER_KN,
        axial_kn=None if reading.axial_n is None else reading.axial_n / N_PER_KN,
        nominal_rpm=reading.nominal_rpm,
        rpm=None if reading.speed is None else reading.speed.value_hz * RPM_PER_HZ,
        bearing=main.bearing,
        fs_hz=reading.fs_hz,
        seconds=None if reading.fs_hz is None else len(main.samples) / reading.fs_hz,
        channels=names,
        channel=reading.channel,
        settings=settings or None,
        cautions=reading.all_cautions(),
    )


def files_under(folder: Path) -> list[Path]:
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
    name, given = load_bearing(settings.bearing).name, settings.bearing
    kept = name if name in known_bearings() else os.path.abspath(given) if given.endswith(".toml") else given
    return replace(settings, bearing=kept)


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
    if pinned is None or pinned.sha256 == found.sha256:
        return found
    return pinned.with_status(
        FileStatus.CHANGED,
        f"SHA-256 was {pinned.sha256[:12]}... when registered and is {found.sha256[:12]}... now; restore the file, "
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
        sha256 = file_sha256(path) if entry.sha256 else ""  # without one it could not even be hashed
    except DataError as error:
        return entry.with_status(FileStatus.UNREADABLE, str(error))
    if sha256 == entry.sha256 and (entry.status is FileStatus.CHANGED or not sha256):
        return inspect_file(path, entry.settings)
    return _compared_with_pin(entry, replace(entry, sha256=sha256))


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
    inspected = _inspect(dict.fromkeys(files_under(folder)), known, silent)
    found = {e.file: _compared_with_pin(known.get(e.file), e) if pinned else e for e in inspected}

    def change(stored: Entries) -> None:
        for key in [key for key in stored if not os.path.exists(key)]:
            del stored[key]
        stored.update((key, entry) for key, entry in found.items() if key not in entries)

    if any(entry != known.get(key) for key, entry in found.items()):
        with contextlib.suppress(DataError):  # a home that cannot be written costs time, not the recordings
            update_manifest(change, store)
    return found
