"""What the sections of stored results have in common: where a result comes from, or how to make one."""

from __future__ import annotations

from srbval.report.badges import Tone
from srbval.report.blocks import Callout, Paragraph
from srbval.storage.stored_result import COMMAND, StoredResult


def origin_of(kept: StoredResult) -> Paragraph:
    """Machine, date, revision and command of a stored result."""
    origin = kept.origin
    processor = str(origin["processor"]).replace("*", " ")
    return Paragraph(
        f"Measured on **{processor}** ({origin['usable_cores']} cores usable), {origin['made_utc']}, "
        f"revision {origin['git_revision'] or 'of an installed copy'}, by `{origin['command']}`. This report did not "
        "measure it again: it shows the newest stored result."
    )


def missing(kind: str) -> Callout:
    """What stands in place of a result that is not there."""
    return Callout(
        tone=Tone.WARNING,
        title="No stored result",
        text=f"There is none on this machine. `{COMMAND[kind]}` makes and keeps one; the next report shows it.",
    )
