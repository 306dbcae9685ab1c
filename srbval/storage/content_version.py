"""Old names of `sources`."""

from srbval.storage.sources import content_version, sources_of

__all__ = ["content_version", "sources_of"]
