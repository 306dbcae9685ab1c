"""Assemble the main report: its sections in order; records, limitations, glossary and command at the end."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.report.blocks import Block, Command, Listing, Report, Section, Tone
from srbval.report.findings.findings import Findings
from srbval.report.pages import Page, join_data, record_words
from srbval.report.prose import Prose, literal
from srbval.report.sections.answer import verdict_box
from srbval.report.sections.figures import figures_section
from srbval.report.sections.table6 import near_section, table6_section
from srbval.signal import NORMAL_95
from srbval.storage.json_files import to_json

RECORD_TEXTS, LIMIT_TEXTS, COMMAND_TEXTS = (
    Prose("srbval.report", f"texts/{name}.md") for name in ("records", "limits", "command")
)
MAX_LISTED = 20  # files in a list; report.json contains all
SHOWN_FACTS = ("srbval", "git_revision", "python", "machine.system", "seeds", "recordings")  # of the provenance


def assemble(findings: Findings, *, command: str, pages: Sequence[Page] = ()) -> Report:
    """Build the main report with the `pages` of studies; `command` is printed as the command that repeats it."""
    origin = {"command": command, **findings.provenance}
    stored = [(page, findings.results[page.name].content) for page in pages if page.name in findings.results]
    data = join_data(findings.data, (page.data(content, findings.results) for page, content in stored))
    data["provenance"] = origin
    verdict = verdict_box(findings, data, (page.tile(Prose(page.package), content) for page, content in stored))
    placed = (
        (10, table6_section(findings)),
        (20, figures_section(findings)),
        (30, near_section(findings)),
        (900, limits_section(findings, data)),
        *((page.place, page.section(findings.results)) for page in pages),
    )
    headline = {"text": f"{verdict.kicker} {verdict.headline}"} | to_json(findings.data["headline"])
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model, Giraudo et al. (Sensors 25, 2419, 2025) and recordings of their rig",
        verdict=verdict,
        sections=tuple(section for _, section in sorted(placed, key=lambda one: one[0])),
        data=data | {"headline": headline},
    )


def records_blocks(findings: Findings) -> Iterator[Block]:
    """List problems of registered recordings, and tabulate the rig's records with their cage ratios."""
    if rows := findings.data["problems"]:
        yield RECORD_TEXTS.callout("problems", tone=Tone.WARNING, files=len({row["file"] for row in rows}))
        more = [RECORD_TEXTS.text("more", more=len(rows) - MAX_LISTED)] if len(rows) > MAX_LISTED else []
        yield Listing((*(RECORD_TEXTS.text("problem", **row) for row in rows[:MAX_LISTED]), *more))
    readings = []
    for one in findings.data["cage_readings"]:
        ci95 = NORMAL_95 * (one.reading_u**2 + one.speed_u**2) ** 0.5
        readings.append(vars(one) | {"name": record_words(Path(one.record).stem), "ratio_ci95": ci95})
    yield RECORD_TEXTS.table("records", readings)


def limits_section(findings: Findings, data: Mapping[str, Any]) -> Section:
    """Make the last section: rig records, limitations, glossary, and the command that repeats the report."""
    axial = any(pair["measured_facts"]["axial_n"] for pair in findings.data["pairs"])
    sources = [COMMAND_TEXTS.text("recordings", **vars(one)) for one in findings.datasets]
    return LIMIT_TEXTS.section(
        *records_blocks(findings),
        Listing((*LIMIT_TEXTS.items("limits", axial="V" if axial else "Axial load, v"), *LIMIT_TEXTS.items("words"))),
        COMMAND_TEXTS.paragraph("again"),
        Command(data["provenance"]["command"]),
        Listing((COMMAND_TEXTS.text("paper"), *sources)),
    )


def provenance_section(origin: Mapping[str, Any]) -> Section:
    """Make the section on the origin of a report: versions, computer, and the command that repeats the report."""
    facts = {**origin, "machine.system": origin.get("machine", {}).get("system")}
    facts |= {key: ", ".join(map(str, facts.get(key, ()))) for key in ("seeds", "recordings")}
    shown = tuple(f"{key}: {literal(str(facts[key]))}" for key in SHOWN_FACTS if facts.get(key))
    return COMMAND_TEXTS.section(COMMAND_TEXTS.paragraph("again"), Command(origin["command"]), Listing(shown))
