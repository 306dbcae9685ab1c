"""Old names of `files`."""

from srbval.storage.files import MOST_BYTES
from srbval.storage.files import read_limited as read_small_file

__all__ = ["MOST_BYTES", "read_small_file"]
