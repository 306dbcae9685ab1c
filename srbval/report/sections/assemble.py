"""Put the report together: its sections in order; the records, the limits, the command and the sources."""

from collections.abc import Iterable, Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from srbval.comparison.comparison import Verdict
from srbval.report.blocks import Block, Command, KeyValues, Listing, Report, Section, Tone, Value
from srbval.report.findings.findings import Findings
from srbval.report.findings.records import badge_of
from srbval.report.pages import Page, joined_data
from srbval.report.prose import Prose
from srbval.report.sections.answer import cage_ratio_section, stated_verdicts, verdict_box
from srbval.report.sections.figures import figures_section
from srbval.report.sections.table6 import speed_or_slip_section, table6_section
from srbval.signal.envelope import FILTER
from srbval.storage.json_files import to_json

RECORDS, LIMITS, GLOSSARY, COMMAND = (
    Prose("srbval.report", f"texts/{name}.md") for name in ("records", "limits", "glossary", "command")
)
MOST_NAMED = 20  # files in a list; report.json has all
GROUPS = {"paper's speed": "paper", "at the rig's speed": "model", "rig side": "rig"}
SHOWN_FACTS = ("srbval", "git_revision", "python", "machine.system", "seeds")  # of the provenance; report.json has all
ROWS = ("comparisons", "pairs", "bias", "line_deviations", "published_speeds", "joint_tests", "runs")


def assemble(findings: Findings, *, command: str, pages: Iterable[Page] = ()) -> Report:
    """Build the report with the `pages` of studies in it; `command` is the one that makes it again."""
    pages = tuple(pages)
    origin = {"command": command, **findings.provenance}
    verdict = verdict_box(findings)
    sources = (COMMAND.text("paper"), *(COMMAND.text("recordings", **vars(one)) for one in findings.datasets))
    placed = (
        (5, cage_ratio_section(findings)),
        (10, records_section(findings)),
        (20, table6_section(findings)),
        (30, speed_or_slip_section(findings)),
        (40, figures_section(findings)),
        (900, limits_section(findings)),
        (910, GLOSSARY.section(GLOSSARY.listing("words"))),
        (920, provenance_section(origin, sources)),
        *((page.place, page.section(findings.results)) for page in pages),
    )
    data = joined_data(findings.data, (page.data(findings.results) for page in pages))
    headline = {"text": verdict.headline} | to_json(findings.data["headline"])
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model, Giraudo et al. (Sensors 25, 2419, 2025) and recordings of their rig",
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=tuple(section for _, section in sorted(placed, key=lambda one: one[0])),
        data=data | {"headline": headline, "provenance": origin},
        rows={f"rows-{name.replace('_', '-')}": data[name] for name in ROWS if name in data},
    )


def records_section(findings: Findings) -> Section:
    """One row for each record, after the problems of the registered data."""
    table = RECORDS.table("records", list(_rows(findings)))
    return RECORDS.section(RECORDS.paragraph("kinds", runs=len(findings.runs)), *_problems(findings), table)


def _problems(findings: Findings) -> Iterator[Block]:
    """Registered recordings that are not used, or are used with a caution; nothing if there are none."""
    if findings.data["register_unreadable"]:
        yield RECORDS.callout("unreadable", tone=Tone.WARNING, why=findings.data["register_unreadable"])
    for name, rows in (("not-used", findings.data["recordings_not_used"]), ("cautions", findings.data["cautions"])):
        if rows:
            yield RECORDS.callout(name, tone=Tone.WARNING, files=len({row["file"] for row in rows}))
            shown = [RECORDS.text(f"{name}-row", **row) for row in rows[:MOST_NAMED]]
            more = [RECORDS.text("more", more=len(rows) - MOST_NAMED)] if len(rows) > MOST_NAMED else []
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


def limits_section(findings: Findings) -> Section:
    """Section on the subjects that the report does not cover, and on open questions."""
    rows = findings.validation.comparisons
    axial = any(pair["measured_facts"]["axial_n"] for pair in findings.validation.pairs.to_dict("records"))
    passing = findings.data["point_passing"]
    khz = {"outer_khz": passing["outer_hz"] / 1e3, "inner_khz": passing["inner_hz"] / 1e3}
    predicted = "prediction_outcome" in findings.results
    missed = missed_sentence(stated_verdicts(findings))
    limits = LIMITS.items("limits", axial="V" if axial else "Axial load, v", **passing | khz)
    return LIMITS.section(Listing((blind_sentence(rows, predicted=predicted), *missed, *limits)))


def blind_sentence(rows: Iterable[Mapping[str, Any]], *, predicted: bool) -> str:
    """Sentence on the records that were unknown before they were compared, and on the stored predictions."""
    blind = list(dict.fromkeys(Path(row["record"]).name for row in rows if row["used_for"] == "blind"))
    text = LIMITS.text("blind", records=", ".join(blind)) if blind else LIMITS.text("not-blind")
    return f"{text} {LIMITS.text('predicted')}" if predicted else text


def missed_sentence(stated: Iterable[Mapping[str, Any]]) -> Iterator[str]:
    """The errors behind the verdicts that are missed, if any is."""
    missed = [LIMITS.text("missed-one", **row) for row in stated if row["verdict"] == Verdict.MISSED]
    if missed:
        yield LIMITS.text("missed", errors="; ".join(missed))


def provenance_section(origin: Mapping[str, Any], sources: tuple[str, ...] = ()) -> Section:
    """Command that reproduces the report, versions and machine, and the sources of its numbers."""
    flat = {key: ", ".join(map(str, v)) if isinstance(v, list) else v for key, v in flatten(origin).items()}
    shown = {key: flat[key] for key in SHOWN_FACTS if flat.get(key)}
    if recordings := ", ".join(origin.get("recordings", ())):
        shown["recordings"] = recordings
    further = [Listing(sources)] if sources else []
    return COMMAND.section(COMMAND.paragraph("again"), Command(str(flat["command"])), KeyValues(pairs=shown), *further)


def flatten(table: Mapping[str, Any], prefix: str = "") -> dict[str, Value]:
    """A nested table with dotted keys."""
    flat: dict[str, Value] = {}
    for key, value in table.items():
        flat |= flatten(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {prefix + key: value}
    return flat
