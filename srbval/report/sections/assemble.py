"""Put the report together from the evidence."""

from collections.abc import Iterable
from datetime import UTC, datetime

from srbval.report.findings.findings import Evidence
from srbval.report.model import Report
from srbval.report.pages import Page, in_order, joined_data
from srbval.report.sections.bands import band_section
from srbval.report.sections.bearing import bearing_section
from srbval.report.sections.closing import (
    assumptions_section,
    failures_section,
    glossary_section,
    limits_section,
    provenance_section,
    references_section,
    runs_section,
    scene_section,
)
from srbval.report.sections.closure import speed_or_slip_section
from srbval.report.sections.ladder import ladder_section
from srbval.report.sections.matrix import matrix_section
from srbval.report.sections.other_rigs import other_rigs_section
from srbval.report.sections.panels import figures_section, paper_speed_section
from srbval.report.sections.records import records_section
from srbval.report.sections.table6 import table6_section, verdict_box
from srbval.storage.json_files import to_json


def assemble(evidence: Evidence, *, command: str, pages: Iterable[Page] = ()) -> Report:
    """Build the report with the `pages` of studies in it; `command` is the one that makes it again."""
    pages = tuple(pages)
    origin = {"command": command, **evidence.provenance}
    verdict = verdict_box(evidence)
    headline = {"text": verdict.headline} | to_json(evidence.headline)
    placed = (
        (10, records_section(evidence)),
        (20, table6_section(evidence)),
        (30, speed_or_slip_section(evidence)),
        (40, figures_section(evidence)),
        (50, ladder_section(evidence)),
        (60, limits_section(evidence)),
        (70, glossary_section()),
        # from here on the appendix alone, but for the command
        (80, bearing_section(evidence)),
        *(((90, paper_speed_section(evidence)),) if evidence.measured_states else ()),
        (100, band_section(evidence)),
        (110, matrix_section(evidence)),
        *((120, section) for section in other_rigs_section(evidence)),
        (130, assumptions_section(evidence)),
        (140, failures_section(evidence)),
        (150, runs_section(evidence)),
        (160, scene_section(evidence)),
        (170, provenance_section(origin)),
        (180, references_section(evidence)),
        *((page.place, page.section(evidence.results)) for page in pages),
    )
    data = joined_data(evidence.to_dict(), (page.data(evidence.results) for page in pages))
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model, Giraudo et al. (Sensors 25, 2419, 2025) and recordings of their rig",
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=in_order(placed),
        data=data | {"headline": headline, "provenance": origin},
    )
