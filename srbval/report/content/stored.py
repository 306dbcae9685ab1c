"""What every section of a stored result says of it: its origin, or how to make one."""

from srbval.evidence.stored import ShownResult
from srbval.report.badges import Tone
from srbval.report.blocks import Callout, Paragraph
from srbval.report.section_texts import Texts

TEXTS = Texts("stored")


def origin_of(result: ShownResult) -> Paragraph:
    """Machine, date, revision and command of a stored result."""
    return TEXTS.paragraph("origin", origin=result.origin)


def missing(result: ShownResult) -> Callout:
    """What stands in place of a result that is not there."""
    return TEXTS.callout("missing", tone=Tone.WARNING, command=result.command)
