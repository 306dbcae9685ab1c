"""The records that the report is made of."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.report.blocks import Block, Listing, Section, Tone
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import badge_of
from srbval.report.prose import Prose
from srbval.signal.envelope import FILTER

TEXTS = Prose("srbval.report", "texts/records.md")
MOST_NAMED = 20  # files in a list; report.json has all
GROUPS = {"paper's speed": "paper", "at the rig's speed": "model", "rig side": "rig"}


def records_section(findings: Findings) -> Section:
    """One row for each record, after the problems of the registered data."""
    table = TEXTS.table("records", list(_rows(findings)))
    return TEXTS.section(TEXTS.paragraph("kinds", runs=len(findings.runs)), *_problems(findings), table)


def _problems(findings: Findings) -> Iterator[Block]:
    """Registered recordings that are not used, or are used with a caution; nothing if there are none."""
    if findings.data["register_unreadable"]:
        yield TEXTS.callout("unreadable", tone=Tone.WARNING, why=findings.data["register_unreadable"])
    for name, rows in (("not-used", findings.data["recordings_not_used"]), ("cautions", findings.data["cautions"])):
        if rows:
            yield TEXTS.callout(name, tone=Tone.WARNING, files=len({row["file"] for row in rows}))
            shown = [TEXTS.text(f"{name}-row", **row) for row in rows[:MOST_NAMED]]
            more = [TEXTS.text("more", more=len(rows) - MOST_NAMED)] if len(rows) > MOST_NAMED else []
            yield Listing((*shown, *more))


def _rows(findings: Findings) -> Iterator[dict[str, Any]]:
    for group, side in GROUPS.items():
        for analysis in findings.analyses[side].values():
            recording, shown, speed = analysis.recording, analysis.processed, analysis.speed
            low, high = shown.band_hz
            yield {
                "name": Path(recording.file).name if recording.file else "model run",
                "name_badge": badge_of(analysis),
                "group": group,
                "state": recording.state.label if recording.state else "not stated",
                "shaft_rpm": 60 * speed.value_hz,
                "shaft_rpm_ci95": 60 * speed.ci95_hz or None,
                "speed_source": speed.source.value,
                "seconds": recording.seconds,
                "band": f"{low:g} to {high:g}, {FILTER}{', tracked' if shown.tracking.used else ''}",
            }
