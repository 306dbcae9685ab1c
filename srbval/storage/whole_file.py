"""Old names of `files`."""

from srbval.storage.files import UNFINISHED, remove_unfinished
from srbval.storage.files import atomic_write as whole_file

__all__ = ["UNFINISHED", "remove_unfinished", "whole_file"]
