"""Results of single scenes, kept so that a study computes each once."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeVar

from srbval.errors import DataError
from srbval.storage.cache import SCENE_RESULTS, cache_folder
from srbval.storage.json_files import read_json, write_json
from srbval.storage.stored_result import content_key

T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class ContentStore:
    """Results of single scenes of one `kind`, which the module `computed_by` computes, a small file each.

    A result's file is named by what it was computed from, as text, and by the version of the code that computes it:
    what is found is what would be computed now. They lie in `folder`, by default in the user's cache.
    """

    kind: str
    computed_by: str
    folder: Path = field(default_factory=lambda: cache_folder(SCENE_RESULTS))

    def load(self, content: str, read: Callable[[dict[str, Any]], T]) -> T | None:
        """What `read` makes of the result computed from `content`; None where there is none or it makes nothing."""
        try:
            return read(read_json(self._path(content)))
        except (DataError, ArithmeticError, LookupError, TypeError, ValueError, AttributeError):
            return None

    def save(self, content: str, table: Any) -> None:
        """Store the result computed from `content`; `DataError` where the folder cannot be written."""
        write_json(self._path(content), table)

    def _path(self, content: str) -> Path:
        return self.folder / f"{self.kind}-{content_key(content, computed_by=self.computed_by)}.json"
