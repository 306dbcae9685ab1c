"""What the report says: one file a section, from `Evidence` to blocks; no drawing, no rendering."""

from srbval.report.content.assemble import assemble

__all__ = ["assemble"]
