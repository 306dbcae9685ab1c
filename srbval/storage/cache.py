"""The user's cache: one folder, with one sub-folder for each kind of content; all of it can be made again.

Below ``platformdirs.user_cache_dir("srbval")``: compiled kernels, results of commands that measure, reference runs. The
kernels alone go elsewhere where ``NUMBA_CACHE_DIR`` names a folder.
"""

import os
import shutil
from dataclasses import dataclass
from pathlib import Path

from srbval.errors import ConfigurationError, DataError

KERNELS = "kernels"
KERNEL_VARIABLE = "NUMBA_CACHE_DIR"


@dataclass(frozen=True, kw_only=True)
class CacheUse:
    """What one kind of content occupies: its folder, the number of files and their size [bytes]."""

    kind: str
    folder: Path
    files: int
    size_bytes: int


def cache_folder(kind: str) -> Path:
    """The folder of this kind of content (``kernels``, ``results``, ...); it need not exist yet."""
    base = os.environ.get(KERNEL_VARIABLE) if kind == KERNELS else None
    return (Path(base) if base else _root()) / kind


def cache_use() -> tuple[CacheUse, ...]:
    """What every kind of content occupies, by name; folders that an earlier version left behind are among them."""
    root = _root()
    names = {path.name for path in root.iterdir()} if root.is_dir() else set()
    kinds = [kind for kind in sorted(names | {KERNELS}) if cache_folder(kind).is_dir()]
    return tuple(_use(kind) for kind in kinds)


def clear_cache(*kinds: str) -> tuple[CacheUse, ...]:
    """Delete these kinds of content, all of them where none is named; returns what was deleted.

    Raises `ConfigurationError` for a kind that is not there, `DataError` where a folder cannot be deleted.
    """
    found = {use.kind: use for use in cache_use()}
    unknown = [kind for kind in kinds if kind not in found]
    if unknown:
        raise ConfigurationError(f"the cache holds no {unknown[0]!r}. It holds: {', '.join(found) or 'nothing'}.")
    chosen = tuple(found[kind] for kind in kinds or found)
    for use in chosen:
        try:
            shutil.rmtree(use.folder)
        except OSError as error:
            raise DataError(f"{use.folder}: cannot be deleted ({error.strerror}).") from None
    return chosen


def _use(kind: str) -> CacheUse:
    folder = cache_folder(kind)
    files = [path for path in folder.rglob("*") if path.is_file()]
    return CacheUse(kind=kind, folder=folder, files=len(files), size_bytes=sum(path.stat().st_size for path in files))


def _root() -> Path:
    import platformdirs

    return Path(platformdirs.user_cache_dir("srbval"))
