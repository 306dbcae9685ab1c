"""Old names of `json_files`."""

from srbval.storage.json_files import json_text as strict_json
from srbval.storage.json_files import parse_json, write_json
from srbval.storage.json_files import to_json as json_object
from srbval.storage.json_files import to_json as json_value

__all__ = ["json_object", "json_value", "parse_json", "strict_json", "write_json"]
