"""Old names of `json_files`."""

from srbval.storage.json_files import checked_line, from_json, read_checked_line

__all__ = ["checked_line", "from_json", "read_checked_line"]
