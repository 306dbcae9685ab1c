"""Put the report together from the findings."""

from collections.abc import Iterable
from datetime import UTC, datetime

from srbval.report.findings.findings import Findings
from srbval.report.model import Report
from srbval.report.pages import Page, in_order, joined_data
from srbval.report.sections.background import (
    assumptions_section,
    bearing_section,
    failures_section,
    glossary_section,
    limits_section,
    provenance_section,
    references_section,
    runs_section,
    scene_section,
)
from srbval.report.sections.bands import band_section
from srbval.report.sections.figures import figures_section, paper_speed_section
from srbval.report.sections.ladder import ladder_section
from srbval.report.sections.matrix import matrix_section
from srbval.report.sections.other_rigs import other_rigs_section
from srbval.report.sections.records import records_section
from srbval.report.sections.table6 import speed_or_slip_section, table6_section, verdict_box
from srbval.storage.json_files import to_json


def assemble(findings: Findings, *, command: str, pages: Iterable[Page] = ()) -> Report:
    """Build the report with the `pages` of studies in it; `command` is the one that makes it again."""
    pages = tuple(pages)
    origin = {"command": command, **findings.provenance}
    verdict = verdict_box(findings)
    headline = {"text": verdict.headline} | to_json(findings.headline)
    placed = (
        (10, records_section(findings)),
        (20, table6_section(findings)),
        (30, speed_or_slip_section(findings)),
        (40, figures_section(findings)),
        (50, ladder_section(findings)),
        (60, limits_section(findings)),
        (70, glossary_section()),
        # from here on the appendix alone, but for the command
        (80, bearing_section(findings)),
        *(((90, paper_speed_section(findings)),) if findings.measured_states else ()),
        (100, band_section(findings)),
        (110, matrix_section(findings)),
        *((120, section) for section in other_rigs_section(findings)),
        (130, assumptions_section(findings)),
        (140, failures_section(findings)),
        (150, runs_section(findings)),
        (160, scene_section(findings)),
        (170, provenance_section(origin)),
        (180, references_section(findings)),
        *((page.place, page.section(findings.results)) for page in pages),
    )
    data = joined_data(findings.data, (page.data(findings.results) for page in pages))
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model, Giraudo et al. (Sensors 25, 2419, 2025) and recordings of their rig",
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=in_order(placed),
        data=data | {"headline": headline, "provenance": origin},
    )
