"""Old names of `stored_result`."""

from srbval.storage.stored_result import ContentStore, content_key

__all__ = ["ContentStore", "content_key"]
