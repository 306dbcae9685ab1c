"""The register itself: `srbval data add`, `list`, `verify`, `remove` and `fetch`."""

import contextlib
import logging
import os
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
REPORT = {"report.html", "report.pdf", "report.json", "figures"}
CAMPAIGN = {"srbval-campaign.json", "results.csv", "lock", "cases"}
# Output of srbval: the file that shows it, a mark in that file, its name, and the names of its parts in that folder.
OWN_OUTPUT = (
    ("report.html", b'<meta name="generator" content="srbval', "report", REPORT),
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
    """Register every file under `folder` (or one file), or the files of a `table` of labels; nothing is copied.

    A file whose SHA-256 is not that of its first registration is reported as changed. `settings` are stored for each
    file, under those of its row of the table (`label_table`); without any, the stored ones stay, also if the file has
    moved. With `repin` hash and settings are replaced. Files that are no recordings are `left_out` of the listing.
    Raises `DataError` for a folder without recordings, a named file that is none, or a manifest that cannot be written,
    `ConfigurationError` for an unknown bearing or an unusable table.
    """
    files: Mapping[Path, RecordingSettings | None]
    if table is None:
        files = dict.fromkeys(files_under(Path(folder)), settings)
    else:
        files = label_table(Path(table), Path(folder), settings or RecordingSettings())
    files = {file: stated and _with_bearing(stated) for file, stated in files.items()}
    registered = read_manifest()
    known = {} if repin else registered
    found = _inspect(files, known, progress)
    gone = {e.sha256: e for e in registered.values() if e.sha256 and not os.path.exists(e.file)}
    for i, entry in enumerate(found if not repin else ()):
        old = gone.get(entry.sha256)
        if old is not None and old.settings and entry.file not in known:
            found[i] = inspect_file(Path(entry.file), (entry.settings or RecordingSettings()).over(old.settings))
    none = [entry for entry in found if entry.status is FileStatus.NO_RECORDING]
    none = [entry for entry in none if known.get(entry.file, entry).sha256 == entry.sha256]
    if none and (len(none) == len(found) or table is not None):
        first = f"{none[0].file}: {none[0].reason}"
        raise DataError(f"{folder}: {len(none)} of {len(found)} files to register are no recordings; {first}")

    def change(entries: Entries) -> None:
        for entry in found:
            if entry.sha256 in gone:
                entries.pop(gone[entry.sha256].file, None)
            entries[entry.file] = entry if repin else _compared(entries.get(entry.file), entry)
        for entry in none:
            del entries[entry.file]

    entries = update_manifest(change)
    return RegisterListing(entries.get(entry.file, entry) for entry in found)


def remove(name: str | Path) -> RegisterListing:
    """Take a file, a folder with all below it, a data set, or the name of one file out of the register.

    Returns the removed entries. Raises `DataError` for an unknown name, `ConfigurationError` for a name in several
    folders.
    """
    path, wanted = Path(os.path.abspath(name)), str(name)
    removed: list[RegisteredRecording] = []

    def change(entries: Entries) -> None:
        every = list(entries.values())
        named = [entry for entry in every if Path(entry.file).name == wanted]
        below = [entry for entry in every if Path(entry.file).is_relative_to(path)]
        removed[:] = below or [entry for entry in every if entry.dataset == wanted] or named
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


def listing(*, or_none: bool = False, hash_all: bool = False, progress: Progress = silent) -> RegisterListing:
    """All registered files, and those in SRBVAL_RECORDINGS, compared with their entries.

    Only files of another size or time of change are hashed, or all of them with `hash_all`. With `or_none` a register
    that cannot be read counts as empty, and the listing has the reason in `unreadable`.
    """
    registered, unreadable = {}, ""
    try:
        registered = read_manifest()
    except DataError as error:
        if not or_none:
            raise
        unreadable = str(error).removeprefix(f"{manifest_path().parent}{os.sep}")
    entries = _with_environment_folder(registered)
    total, done, compared = sum(e.size_bytes for e in entries.values()), 0, []
    for entry in entries.values():
        compared.append(entry if not hash_all and _unchanged(entry) else _verified(entry))
        done += entry.size_bytes
        progress("Verify", done / max(total, 1))
    return RegisterListing(compared, unreadable)


def verify(*, progress: Progress = silent) -> RegisterListing:
    """All registered files, each hashed again and compared with its entry."""
    return listing(hash_all=True, progress=progress)


def fetch(name: str, folder: str | Path | None = None, *, progress: Progress = silent) -> RegisterListing:
    """Download the open data set `name` into `folder` (default: below the home folder) and register it."""
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
    """The rig's open excerpts that come with the program, in compact form; a file in their folder states the source."""
    return tuple(_of_folder(shipped_folder(RIG_EXCERPTS), {}, pinned=False).values())


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


def inspect_file(path: Path, settings: RecordingSettings | None = None) -> RegisteredRecording:
    """Hash and read `path`; every failure becomes a status, settings that do not fit and open questions a reason."""
    entry = RegisteredRecording(file=str(path), sha256="", size_bytes=0, mtime_ns=0, status=FileStatus.OK)
    try:
        size, mtime_ns = _size_and_time(path)
        if not path.is_file():
            return entry.with_status(FileStatus.UNREADABLE, "not a regular file")
        if output := _own_output(path):
            return entry.with_status(FileStatus.NO_RECORDING, output)
        entry = replace(entry, size_bytes=size, mtime_ns=mtime_ns, sha256=file_sha256(path))
        entry = _described(replace(entry, format=detect_format(path).name), path, settings or RecordingSettings())
    except OSError as error:
        return entry.with_status(FileStatus.UNREADABLE, f"cannot be read ({error.strerror})")
    except NoRecordingError as error:
        return entry.with_status(FileStatus.NO_RECORDING, str(error).removeprefix(f"{path}: "))
    except SrbvalError as error:
        text = str(error).removeprefix(f"{path}: ")
        cut = "truncated: " in text or "truncated file" in text  # the words of the loaders and of the HDF5 library
        return entry.with_status(FileStatus.TRUNCATED if cut else FileStatus.UNREADABLE, text)
    expected = (file for d in known_datasets() if d.name == entry.dataset for file in d.files)
    published = next((file.sha256 for file in expected if file.name == path.name and file.sha256), entry.sha256)
    if published != entry.sha256:
        return entry.with_status(FileStatus.CHANGED, f"its SHA-256 is not the published {published[:12]}...")
    return entry


def _described(entry: RegisteredRecording, path: Path, settings: RecordingSettings) -> RegisteredRecording:
    """The entry with the contents of its file, read with the settings that fit it."""
    file, wrong = read_file(path), []
    try:
        reading = apply_settings(path, file, settings)
    except DataError:  # one by one, to keep the settings that fit
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


def _own_output(path: Path) -> str | None:
    """Text about the report or campaign that a file is a part of, None for any other file."""
    for folder in path.parents[:2]:
        for shown_by, mark, what, parts in OWN_OUTPUT:
            if path.relative_to(folder).parts[0] in parts:
                with contextlib.suppress(OSError), (folder / shown_by).open("rb") as file:
                    if mark in file.read(HEAD_BYTES):
                        return f"part of a {what} that srbval wrote, {folder}"
    return None


def _with_bearing(settings: RecordingSettings) -> RecordingSettings:
    """The settings with a bearing that can be loaded from every folder: a file by its whole path."""
    if settings.bearing is None:
        return settings
    name, given = load_bearing(settings.bearing).name, settings.bearing
    kept = name if name in known_bearings() else os.path.abspath(given) if given.endswith(".toml") else given
    return replace(settings, bearing=kept)


def _inspect(
    files: Mapping[Path, RecordingSettings | None], known: Entries, progress: Progress
) -> list[RegisteredRecording]:
    """Inspect every file, or take its entry from `known` if size and time of change are the same."""
    sizes = [_size_and_time(path)[0] for path in files]
    total, done, found = sum(sizes), 0, []

    def inspect(path: Path) -> RegisteredRecording:
        old, settings = known.get(str(path)), files[path]
        if old and not settings and _unchanged(old):
            return old
        stored = (old and old.settings) or RecordingSettings()
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


def _compared(old: RegisteredRecording | None, found: RegisteredRecording) -> RegisteredRecording:
    """The entry of a file for the register: the old hash stays, and a file that differs from it is marked."""
    if old is None or old.sha256 == found.sha256:
        return found
    text = (
        f"SHA-256 was {old.sha256[:12]}... when registered and is {found.sha256[:12]}... now; restore the file, "
        "or register it again if it was changed on purpose (`srbval data add --repin`)"
    )
    return old.with_status(FileStatus.CHANGED, text)


def _verified(entry: RegisteredRecording) -> RegisteredRecording:
    path = Path(entry.file)
    if not path.exists():
        return entry.with_status(FileStatus.MISSING, "the file is no longer there")
    size, _ = _size_and_time(path)
    if size < entry.size_bytes:
        text = f"{size} bytes where {entry.size_bytes} were registered; copy the file again"
        return entry.with_status(FileStatus.TRUNCATED, text)
    try:
        sha256 = file_sha256(path) if entry.sha256 else ""  # without one it could not even be hashed
    except DataError as error:
        return entry.with_status(FileStatus.UNREADABLE, str(error))
    if sha256 == entry.sha256 and (entry.status is FileStatus.CHANGED or not sha256):
        return inspect_file(path, entry.settings)
    return _compared(entry, replace(entry, sha256=sha256))


def _with_environment_folder(entries: Entries) -> Entries:
    """The entries, and the files of the folder in SRBVAL_RECORDINGS if it is set."""
    set_by_user = os.environ.get(RECORDINGS_VARIABLE)
    if not set_by_user:
        return entries
    folder = Path(set_by_user).expanduser()
    if not folder.is_dir():
        raise DataError(f"{RECORDINGS_VARIABLE} is {set_by_user!r}, which is not a folder. Correct it or unset it.")
    return {**entries, **_of_folder(folder, entries)}


def _of_folder(folder: Path, entries: Entries, *, pinned: bool = True) -> Entries:
    """The files of a folder that is not registered; if `pinned`, files that changed since are marked."""
    store = inspected_path()
    try:
        known = read_manifest(store)
    except DataError:  # it cannot be read: the files are inspected again
        known = {}
        with contextlib.suppress(OSError):
            store.unlink()
    known = {key: entry for key, entry in known.items() if os.path.exists(key)} | entries
    inspected = _inspect(dict.fromkeys(files_under(folder)), known, silent)
    found = {e.file: _compared(known.get(e.file), e) if pinned else e for e in inspected}

    def change(stored: Entries) -> None:
        kept = {key: entry for key, entry in stored.items() if os.path.exists(key)}
        stored.clear()
        stored.update(kept | {key: entry for key, entry in found.items() if key not in entries})

    if any(entry != known.get(key) for key, entry in found.items()):
        with contextlib.suppress(DataError):  # a home that cannot be written costs time, not the recordings
            update_manifest(change, store)
    return found
