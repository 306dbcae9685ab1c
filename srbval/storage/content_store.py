"""Cache of results that can be computed again: one small file each, named by a hash of its input and source code.

A file ends with a checksum and is written completely or not at all; a damaged file counts as missing. Any number of
processes may read and write at the same time. Beyond `LIMIT_BYTES`, the least recently used files are removed.
"""

import contextlib
import dataclasses
import hashlib
import json
import os
import pickle
import re
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeVar

from srbval.errors import DataError, SrbvalError
from srbval.storage.files import UNFINISHED, atomic_write
from srbval.storage.hdf5_files import append_checksum, checked_summary
from srbval.storage.installation import SCENE_RESULTS, cache_folder
from srbval.storage.json_files import to_json
from srbval.storage.sources import content_version

T = TypeVar("T")
FRESH = "SRBVAL_FRESH"  # environment variable that --fresh sets: stored results are not read
STORED_FILES = re.compile(r".+-[0-9a-f]{32}\.(json|result|h5)")
LIMIT_BYTES = 10**9
LARGEST_BYTES = LIMIT_BYTES // 4  # largest result that is stored
KEPT_SHARE = 0.9  # share of the limit that is kept after it was exceeded
ABANDONED_S = 86_400.0  # age at which an unfinished file counts as abandoned

_read_utc: list[str] = []  # dates of the results that this process has read, ISO 8601


@contextlib.contextmanager
def stored_results(*, fresh: bool = False) -> Iterator[list[str]]:
    """Context; yields a list that receives the date of each stored result that is read. With `fresh` none is read."""
    before, _read_utc[:] = os.environ.get(FRESH, ""), []
    os.environ[FRESH] = "1" if fresh else before
    try:
        yield _read_utc
    finally:
        os.environ[FRESH] = before


def content_key(content: str, *, computed_by: str, lazy: bool = True) -> str:
    """Hash (32 digits) of `content` and of the sources of module `computed_by`; for `lazy` see `sources_of`."""
    return hashlib.sha256(f"{content_version(computed_by, lazy=lazy)} {content}".encode()).hexdigest()[:32]


class _FieldsPickler(pickle.Pickler):
    """Pickler that writes only the fields of dataclasses, not cached properties."""

    def reducer_override(self, value: Any) -> Any:
        if isinstance(value, type) or not dataclasses.is_dataclass(value):
            return NotImplemented
        return type(value), tuple(getattr(value, one.name) for one in dataclasses.fields(value))


def content_sha256(*values: Any) -> str:
    """Hash of arrays, dataclasses and other values that can be pickled; the same in every process."""
    digest = hashlib.sha256()
    pickler = _FieldsPickler(SimpleNamespace(write=digest.update), protocol=5)  # hashes without copying
    pickler.fast = True  # equal values give equal bytes, whether they are one object or two
    pickler.dump(values)
    return digest.hexdigest()


@dataclass(frozen=True, kw_only=True)
class ContentStore:
    """Store for results of one `kind`, computed by the module `computed_by`, in `folder` (default: the user's cache).

    File names contain a hash of the code and of `content`, a text that identifies the input of the result. The code of
    the models is not included, because models are imported only when they are used; the `content` that identifies a
    run therefore contains a hash of its model's code.
    """

    kind: str
    computed_by: str
    suffix: str = ".result"
    folder: Path | None = None

    def path(self, content: str) -> Path:
        """Path of the file with the result for the input `content`."""
        key = content_key(content, computed_by=self.computed_by, lazy=False)
        return (self.folder or cache_folder(SCENE_RESULTS)) / f"{self.kind}-{key}{self.suffix}"

    def load(self, content: str, read: Callable[[Any], T]) -> T | None:
        """Load the JSON stored for the input `content` and convert it by `read`; None if missing or not convertible."""
        path = self.path(content)
        if os.environ.get(FRESH):
            return None
        try:
            stored = checked_summary(path)
            found = None if stored is None else read(json.loads(stored))
            made_s = path.stat().st_mtime
            os.utime(path, (time.time(), made_s))  # set the access time, which some file systems do not update
        except (OSError, SrbvalError, ArithmeticError, LookupError, TypeError, ValueError, AttributeError):
            return None
        if found is not None:
            _read_utc.append(datetime.fromtimestamp(made_s, UTC).isoformat(timespec="seconds"))
        return found

    def save(self, content: str, table: Any) -> None:
        """Store the result `table` for the input `content` as JSON (`to_json`); NaN and infinity are kept."""

        def write(path: Path) -> None:
            with atomic_write(path) as part:
                append_checksum(part, json.dumps(table, default=to_json).encode())

        self.keep(content, write)

    def keep(self, content: str, write: Callable[[Path], None]) -> None:
        """Have `write` store the result for the input `content` at the path it receives; write errors are ignored."""
        path = self.path(content)
        with contextlib.suppress(DataError, OSError):
            write(path)
            make_room(path.parent)


def make_room(folder: Path, limit_bytes: float = LIMIT_BYTES) -> None:
    """Remove unfinished files older than `ABANDONED_S` [s] and, above `limit_bytes`, the least recently used files."""
    found = {}
    for entry in os.scandir(folder):
        with contextlib.suppress(FileNotFoundError):  # another process removed it
            about = entry.stat(follow_symlinks=False)
            if UNFINISHED.fullmatch(entry.name) and time.time() - about.st_mtime > ABANDONED_S:
                Path(entry).unlink()
            elif STORED_FILES.fullmatch(entry.name):
                found[Path(entry)] = about
    left = sum(about.st_size for about in found.values())
    if left > limit_bytes:
        for path in sorted(found, key=lambda path: found[path].st_atime_ns):
            if left <= KEPT_SHARE * limit_bytes:
                return
            path.unlink(missing_ok=True)
            left -= found[path].st_size
