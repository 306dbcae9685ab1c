"""The verbs of `srbval data`: add, list, verify, and the look-up the report uses."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.progress import Progress, silent
from srbval.recordings.load import sha256_of
from srbval.recordings.registry.coverage import coverage
from srbval.recordings.registry.entry import Listing, RegisteredRecording, Status
from srbval.recordings.registry.home import recordings_folder
from srbval.recordings.registry.inspect import inspect_file
from srbval.recordings.registry.manifest import (
    Entries,
    looked_at_path,
    manifest_path,
    read_manifest,
    update_manifest,
)
from srbval.recordings.registry.once import each_once
from srbval.recordings.settings import Settings

MAX_WORKERS = 4
RIG_DATASETS = ("torino-full", "torino-excerpts")  # the longer recordings first


def add(
    folder: str | Path,
    *,
    progress: Progress = silent,
    repin: bool = False,
    settings: Settings | None = None,
) -> Listing:
    """Register every file under `folder` (or one file); nothing is copied.

    A file seen for the first time is pinned with its SHA-256; one that differs from its pin is reported as
    changed and keeps the pin, unless `repin`. `settings` are kept for each of the files and used whenever one is
    loaded; without any, those kept before stay (`repin` forgets them). A file that was registered elsewhere and is no
    longer there has moved: its old entry goes, what was settled for it stays (but for `repin`). Files that are no
    recording stay in the list with a reason.
    Raises `DataError` for a folder that is not there or a manifest that cannot be written.
    """
    files = _files_under(Path(folder))
    registered = read_manifest()
    known = {} if repin else registered
    gone = [e for e in registered.values() if e.sha256 and not os.path.exists(e.file)]
    seen = _inspect(files, known, progress, settings)
    if not repin:
        seen = [entry if entry.file in known else _as_settled_before(entry, gone) for entry in seen]
    there = {entry.sha256 for entry in seen}
    merged: Entries = {}

    def change(entries: Entries) -> None:
        for old in gone:
            if old.sha256 in there:
                entries.pop(old.file, None)
        for entry in seen:
            entries[entry.file] = entry if repin else _against_pin(entries.get(entry.file), entry)
            merged[entry.file] = entries[entry.file]

    update_manifest(change)
    return _listing(merged.values())


def listing() -> Listing:
    """All registered files with their status by a quick look (size and time of change, not the hash).

    Files of the folder that SRBVAL_RECORDINGS names are among them whether registered or not.
    """
    entries = _with_environment_folder(read_manifest())
    return _listing(_quick_look(entry) for entry in entries.values())


def verify(*, progress: Progress = silent) -> Listing:
    """All registered files, each hashed again and compared with its pin."""
    entries = _with_environment_folder(read_manifest())
    total, done, checked = sum(e.size_bytes for e in entries.values()), 0, []
    for entry in entries.values():
        checked.append(_verified(entry))
        done += entry.size_bytes
        progress("Verify", _fraction(done, total))
    return _listing(checked)


def rig_recordings(*, state: Fault | None = None, nominal_rpm: float | None = None) -> tuple[RegisteredRecording, ...]:
    """Usable recordings of the rig by state and nominal motor speed [rpm], full recordings first, each content once."""
    found = [
        r
        for r in listing().recordings
        if r.dataset in RIG_DATASETS
        and r.status is Status.OK
        and state in (None, r.state)
        and nominal_rpm in (None, r.nominal_rpm)
    ]
    return tuple(sorted(each_once(found), key=lambda r: (RIG_DATASETS.index(r.dataset or ""), r.file)))


def find_recording(
    *, state: Fault, nominal_rpm: float, radial_kn: float = 124.8, axial_kn: float = 0.0
) -> RegisteredRecording | None:
    """The rig recording at one operating point [rpm, kN], or None; the longest if there are several."""
    found = rig_recordings(state=state, nominal_rpm=nominal_rpm)
    at_load = [r for r in found if (r.radial_kn, r.axial_kn) == (radial_kn, axial_kn)]
    return max(at_load, key=lambda r: r.seconds or 0.0, default=None)


def _listing(entries: Iterable[RegisteredRecording]) -> Listing:
    recordings = tuple(sorted(entries, key=lambda e: e.file))
    return Listing(manifest=manifest_path(), recordings=recordings, coverage=coverage(recordings))


def _files_under(folder: Path) -> list[Path]:
    """Regular files below `folder`, sorted; hidden ones and links to folders are passed over."""
    if folder.is_file():
        return [Path(os.path.abspath(folder))]
    if not folder.is_dir():
        raise DataError(f"{folder}: no such folder. Check the path.")
    found = sorted(_walk(Path(os.path.abspath(folder))))
    if not found:
        raise DataError(f"{folder}: holds no file. Name the folder that holds the recordings.")
    return found


def _walk(folder: Path) -> Iterator[Path]:
    for parent, folders, names in os.walk(folder):
        folders[:] = [name for name in folders if not name.startswith(".")]
        yield from (Path(parent, name) for name in names if not name.startswith("."))


def _inspect(
    files: list[Path], known: Entries, progress: Progress, settings: Settings | None = None
) -> list[RegisteredRecording]:
    """Each file looked at; one whose size and time of change are those pinned is taken from `known`.

    New `settings` go over those kept for a file.
    """
    sizes = [_size(path) for path in files]
    total, done, seen = sum(sizes), 0, []

    def look(path: Path) -> RegisteredRecording:
        pinned = known.get(str(path))
        kept = (pinned.settings if pinned is not None else None) or Settings()
        if pinned is not None and not settings and _untouched(pinned):
            return pinned
        return inspect_file(path, settings.over(kept) if settings else kept)

    with ThreadPoolExecutor(min(MAX_WORKERS, os.cpu_count() or 1)) as pool:  # hashing and reading free the GIL
        for entry, size in zip(pool.map(look, files), sizes, strict=True):
            seen.append(entry)
            done += size
            progress("Register", _fraction(done, total))
    return seen


def _as_settled_before(entry: RegisteredRecording, gone: list[RegisteredRecording]) -> RegisteredRecording:
    """`entry`, read with what was settled for the same content at a place where it is no longer."""
    before = next((old.settings for old in gone if old.sha256 == entry.sha256 and old.settings), None)
    if before is None:
        return entry
    return inspect_file(Path(entry.file), entry.settings.over(before) if entry.settings else before)


def _fraction(done: int, total: int) -> float:
    """Of the bytes; files that are all empty count as done."""
    return done / total if total else 1.0


def _size(path: Path) -> int:
    try:
        return path.stat().st_size
    except OSError:
        return 0


def _untouched(entry: RegisteredRecording) -> bool:
    try:
        stat = Path(entry.file).stat()
    except OSError:
        return False
    return (stat.st_size, stat.st_mtime_ns) == (entry.size_bytes, entry.mtime_ns)


def _against_pin(pinned: RegisteredRecording | None, seen: RegisteredRecording) -> RegisteredRecording:
    """What the register keeps: the pin stays, and a file that differs from it is marked."""
    if pinned is None or pinned.sha256 == seen.sha256:
        return seen
    return pinned.with_status(Status.CHANGED, _changed(pinned, seen.sha256))


def _changed(pinned: RegisteredRecording, sha256: str) -> str:
    return (
        f"SHA-256 was {pinned.sha256[:12]}... when registered and is {sha256[:12]}... now; restore the file, "
        "or register it anew as changed on purpose (`srbval data add --repin`)"
    )


def _quick_look(entry: RegisteredRecording) -> RegisteredRecording:
    return entry if _untouched(entry) else _verified(entry)


def _verified(entry: RegisteredRecording) -> RegisteredRecording:
    path = Path(entry.file)
    if not path.exists():
        return entry.with_status(Status.MISSING, "the file is no longer there")
    size = _size(path)
    if size < entry.size_bytes:
        return entry.with_status(
            Status.TRUNCATED, f"{size} bytes where {entry.size_bytes} were registered; copy the file again"
        )
    if not entry.sha256:  # it could not even be hashed
        return inspect_file(path, entry.settings)
    try:
        sha256 = sha256_of(path)
    except DataError as error:
        return entry.with_status(Status.UNREADABLE, str(error))
    if sha256 != entry.sha256:
        return entry.with_status(Status.CHANGED, _changed(entry, sha256))
    return inspect_file(path, entry.settings) if entry.status is Status.CHANGED else entry


def _with_environment_folder(entries: Entries) -> Entries:
    """Add the files of SRBVAL_RECORDINGS, for as long as it names their folder.

    What a look at them found is kept apart from the register, so that they are not read again each time.
    """
    folder = recordings_folder()
    if folder is None:
        return entries
    known = {**_looked_at_before(), **entries}
    seen = {e.file: _against_pin(known.get(e.file), e) for e in _inspect(_files_under(folder), known, silent)}
    if any(key not in known for key in seen):
        with contextlib.suppress(DataError):  # a home that cannot be written costs time, not the recordings
            _remember({key: entry for key, entry in seen.items() if key not in entries})
    return {**entries, **seen}


def _looked_at_before() -> Entries:
    """Of files that still are there; what cannot be read is looked at again."""
    try:
        return {key: entry for key, entry in read_manifest(looked_at_path()).items() if os.path.exists(key)}
    except DataError:
        with contextlib.suppress(OSError):
            looked_at_path().unlink()
        return {}


def _remember(looked_at: Entries) -> None:
    """Keep what was found, and forget files that are gone."""

    def change(entries: Entries) -> None:
        for key in [key for key in entries if not os.path.exists(key)]:
            del entries[key]
        entries.update(looked_at)

    update_manifest(change, looked_at_path())
