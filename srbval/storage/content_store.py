"""Results of single scenes on disk: one small JSON file each, named by everything that it depends on."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from srbval.config.small_file import read_small_file
from srbval.errors import DataError
from srbval.storage.cache import cache_folder
from srbval.storage.content_version import content_version
from srbval.storage.strict_json import parse_json, write_json

T = TypeVar("T")
SCENE_RESULTS = "scene-results"  # kind of content of the cache


@dataclass(frozen=True, kw_only=True)
class ContentStore:
    """Results of one `kind`, which the module `computed_by` computes, in `folder` (default: the user's cache).

    A result's file is named by what it was computed from, as text, and by the version of the code that computes it:
    what is found is what would be computed now.
    """

    kind: str
    computed_by: str
    folder: Path = field(default_factory=lambda: cache_folder(SCENE_RESULTS))

    def load(self, content: str, read: Callable[[dict[str, Any]], T]) -> T | None:
        """What `read` makes of the result computed from `content`; None where there is none or it makes nothing."""
        try:
            return read(parse_json(read_small_file(self._path(content))))
        except (DataError, ArithmeticError, LookupError, TypeError, ValueError, AttributeError):
            return None

    def save(self, content: str, table: Any) -> None:
        """Store the result computed from `content`; `DataError` where the folder cannot be written."""
        write_json(self._path(content), table)

    def _path(self, content: str) -> Path:
        return self.folder / f"{self.kind}-{content_key(content, computed_by=self.computed_by)}.json"


def content_key(content: str, *, computed_by: str) -> str:
    """Hash of `content` and of all code behind the module `computed_by`, 32 hexadecimal digits."""
    return hashlib.sha256(f"{content_version(computed_by)} {content}".encode()).hexdigest()[:32]
