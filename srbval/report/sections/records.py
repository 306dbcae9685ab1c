"""Which records the report is made of."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from srbval.reading.analyse import Analysis
from srbval.recordings import Origin
from srbval.report.badges import Tone
from srbval.report.blocks import Block, Listing
from srbval.report.findings.findings import Evidence
from srbval.report.model import Section
from srbval.report.section_texts import Texts
from srbval.report.sections.names import FETCH_COMMAND, badge_of, synthetic_states

TEXTS = Texts("records")
MOST_NAMED = 20  # files in a list; report.json has all


def records_section(evidence: Evidence) -> Section:
    """One row per record; a warning where the rig side is synthetic."""
    synthetic = synthetic_states(evidence.rig)
    warning = TEXTS.callout("synthetic", tone=Tone.WARNING, synthetic=synthetic, fetch_command=FETCH_COMMAND)
    return TEXTS.section(
        *((warning,) if synthetic else ()),
        TEXTS.paragraph(
            "kinds",
            runs=len(evidence.runs),
            states=len(evidence.rig),
            measured=sum(a.recording.origin is Origin.MEASURED for a in evidence.rig.values()),
            synthetic=synthetic,
        ),
        *_problems(evidence),
        TEXTS.table("records", _rows(evidence)),
        appendix=(TEXTS.paragraph("chain"), TEXTS.table("lines-found", _rows(evidence))),
    )


def _problems(evidence: Evidence) -> Iterator[Block]:
    """What of the registered data is not used, and what is used with a caution; nothing where all is well."""
    if evidence.register.unreadable:
        yield TEXTS.callout("unreadable", tone=Tone.WARNING, why=evidence.register.unreadable)
    for name, rows in (("not-used", evidence.not_used), ("cautions", evidence.cautions)):
        if rows:
            yield TEXTS.callout(name, tone=Tone.WARNING, count=len(rows), files=len({row["file"] for row in rows}))
            shown = (TEXTS.text(f"{name}-row", row=row) for row in rows[:MOST_NAMED])
            more = (TEXTS.text("more", more=len(rows) - MOST_NAMED),) if len(rows) > MOST_NAMED else ()
            yield Listing(items=(*shown, *more))


def _rows(evidence: Evidence) -> Iterator[dict[str, Any]]:
    at_rig = [evidence.model_at_rig[state] for state in evidence.measured_states]
    groups = {"paper's speed": evidence.paper.values(), "at the rig's speed": at_rig, "rig side": evidence.rig.values()}
    for group, analyses in groups.items():
        yield from (_row(group, analysis) for analysis in analyses)


def _row(group: str, analysis: Analysis) -> dict[str, Any]:
    recording, shown = analysis.recording, analysis.processed
    low, high = shown.band_hz
    tracked = ", tracked" if shown.tracking.used else ""
    return {
        "name": Path(recording.file).name if recording.file else "model run",
        "badge": badge_of(analysis),
        "group": group,
        "state": recording.state.label if recording.state else "not stated",
        "speed": analysis.speed,
        "seconds": recording.seconds,
        "band": f"{low:g} to {high:g}, {shown.band_filter.value}{tracked}",
        "lines": detected_lines(analysis),
    }


def detected_lines(analysis: Analysis) -> str:
    """The detected race and roller lines in a few words, the strongest first."""
    lines = [n for n in analysis.lines if n.detected and n.harmonic == 1 and n.name in ("BPFO", "BPFI", "2xBSF")]
    if not lines:
        return "no race or roller line"
    strongest_first = sorted(lines, key=lambda n: -(n.snr or 0))
    return "; ".join(f"{n.name} {n.found_hz:.2f} Hz ({n.deviation_pct:+.2f} %)" for n in strongest_first)
