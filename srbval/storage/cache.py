"""User's cache folder, with one sub-folder per kind of content; everything in it can be computed again.

The folder ``platformdirs.user_cache_dir("srbval")`` contains compiled kernels, results of studies, and results for
scenes and records. If ``NUMBA_CACHE_DIR`` names a folder, the kernels are stored in its sub-folder ``srbval``.
"""

import contextlib
import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import ConfigurationError, DataError

KERNELS, STUDY_RESULTS, SCENE_RESULTS = "kernels", "results", "scene-results"  # kinds of content
KERNEL_VARIABLE = "NUMBA_CACHE_DIR"


@dataclass(frozen=True, kw_only=True)
class CacheUse:
    """Disk space of one `kind` of cached content: folder, number of files and size [bytes]."""

    kind: str
    folder: Path
    files: int
    size_bytes: int


def cache_folder(kind: str) -> Path:
    """Folder of one `kind` of cached content (``kernels``, ``results``, ...); it may not exist yet."""
    base = os.environ.get(KERNEL_VARIABLE) if kind == KERNELS else None
    return (Path(base, "srbval") if base else _root()) / kind


def cache_use() -> tuple[CacheUse, ...]:
    """Disk space of every kind of cached content, sorted by name; includes folders of earlier versions of srbval."""
    kinds = {path.name for path in _root().iterdir()} if _root().is_dir() else set()
    return tuple(_use_of(kind) for kind in sorted(kinds | {KERNELS}) if cache_folder(kind).is_dir())


def _use_of(kind: str) -> CacheUse:
    sizes = []
    for path in cache_folder(kind).rglob("*"):
        with contextlib.suppress(FileNotFoundError):  # deleted meanwhile
            if path.is_file():
                sizes.append(path.stat().st_size)
    return CacheUse(kind=kind, folder=cache_folder(kind), files=len(sizes), size_bytes=sum(sizes))


def clear_cache(*kinds: str) -> tuple[CacheUse, ...]:
    """Delete the folders of these `kinds` (default: all) and return their size; an unknown kind is an error."""
    found = {use.kind: use for use in cache_use()}
    unknown = [kind for kind in kinds if kind not in found]
    if unknown:
        raise ConfigurationError(f"the cache contains no {unknown[0]!r}. It contains: {', '.join(found) or 'nothing'}.")
    chosen = tuple(found[kind] for kind in kinds or found)
    for use in chosen:
        try:
            shutil.rmtree(use.folder)
        except OSError as error:
            raise DataError(f"{use.folder}: cannot be deleted ({error.strerror or error}).") from None
    return chosen


def _root() -> Path:
    import platformdirs

    return Path(platformdirs.user_cache_dir("srbval"))
