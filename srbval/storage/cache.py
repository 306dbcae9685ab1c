"""User's cache folder, with one sub-folder per kind of content; everything in it can be computed again.

The folder ``platformdirs.user_cache_dir("srbval")`` contains compiled kernels, results of studies, and results for
scenes and records. If ``NUMBA_CACHE_DIR`` names a folder, the kernels are stored there instead.
"""

import contextlib
import os
import re
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import ConfigurationError, DataError
from srbval.storage.files import UNFINISHED

KERNELS, STUDY_RESULTS, SCENE_RESULTS = "kernels", "results", "scene-results"  # kinds of content
KERNEL_VARIABLE = "NUMBA_CACHE_DIR"
# Names of files that srbval and its compiler write; other files must not be deleted.
KERNEL_FILES = re.compile(
    r".+\.kernel|.+\.nb[ic](\.tmp\.[0-9a-f]+)?|[a-z0-9-]+\.lock|compiled-[a-z]+-[a-z]+-[12][a-z-]*-[0-9a-f]{12,16}|"
    + UNFINISHED.pattern
)
STORED_FILES = re.compile(r".+-[0-9a-f]{32}\.(json|result|h5)")
RESULT_FILES = re.compile(f"{STORED_FILES.pattern}|{UNFINISHED.pattern}")
NAMED_RESULT = re.compile(r"[a-z_]+\.json")  # written by srbval if it begins with the schema version and its name
RESULT_START = re.compile(rb'\{\s*"schema_version": \d+,\s*"kind": "([a-z_]+)"')


@dataclass(frozen=True, kw_only=True)
class CacheUse:
    """Disk space of one `kind` of cached content: folder, number of files and size [bytes].

    `left` is the number of files and links that srbval did not write; they are neither counted nor deleted.
    """

    kind: str
    folder: Path
    files: int
    size_bytes: int
    left: int = 0


def cache_folder(kind: str) -> Path:
    """Folder of one `kind` of cached content (``kernels``, ``results``, ...); it may not exist yet."""
    base = os.environ.get(KERNEL_VARIABLE) if kind == KERNELS else None
    return (Path(base) if base else _root()) / kind


def cache_use() -> tuple[CacheUse, ...]:
    """Disk space of every kind of cached content, sorted by name; includes folders of earlier versions of srbval."""
    root = _root()
    names = {Path(name).name for name in next(os.walk(root), (root, [], []))[1]}
    kinds = [kind for kind in sorted(names | {KERNELS}) if cache_folder(kind).is_dir()]
    found = ((kind, *_files(kind)) for kind in kinds if not cache_folder(kind).is_symlink())
    return tuple(
        CacheUse(kind=kind, folder=cache_folder(kind), files=len(own), size_bytes=sum(own.values()), left=left)
        for kind, own, left in found
    )


def clear_cache(*kinds: str) -> tuple[CacheUse, ...]:
    """Delete cached content of these `kinds` (default: all) and return its size; an unknown kind is an error."""
    found = {use.kind: use for use in cache_use()}
    unknown = [kind for kind in kinds if kind not in found]
    if unknown:
        raise ConfigurationError(f"the cache contains no {unknown[0]!r}. It contains: {', '.join(found) or 'nothing'}.")
    chosen = tuple(found[kind] for kind in kinds or found)
    for use in chosen:
        files, _ = _files(use.kind)
        try:
            for path in files:
                path.unlink(missing_ok=True)
        except OSError as error:
            raise DataError(f"{use.folder}: cannot be deleted ({error.strerror}).") from None
        folders = {folder for path in files for folder in path.parents if folder.is_relative_to(use.folder)}
        for folder in sorted(folders or {use.folder}, reverse=True):
            with contextlib.suppress(OSError):  # it contains other files
                folder.rmdir()
    return chosen


def _files(kind: str) -> tuple[dict[Path, int], int]:
    """Find cached files of a kind that srbval wrote, with sizes [bytes]; count the other files and links."""
    own, left = {}, 0
    for folder, inner, names in os.walk(cache_folder(kind)):
        left += sum(Path(folder, name).is_symlink() for name in inner)
        for path in (Path(folder, name) for name in names):
            try:
                if path.is_symlink() or not path.is_file() or not _is_ours(path, kind):
                    left += 1
                else:
                    own[path] = path.stat().st_size
            except OSError:  # deleted meanwhile, or not readable
                left += path.exists()
    return own, left


def _is_ours(path: Path, kind: str) -> bool:
    if kind == KERNELS or not NAMED_RESULT.fullmatch(path.name):
        return (KERNEL_FILES if kind == KERNELS else RESULT_FILES).fullmatch(path.name) is not None
    with path.open("rb") as stream:
        start = RESULT_START.match(stream.read(200))
    return start is not None and start[1].decode() == path.stem


def _root() -> Path:
    import platformdirs

    return Path(platformdirs.user_cache_dir("srbval"))
