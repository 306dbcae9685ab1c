"""Put the report together from the evidence."""

from datetime import UTC, datetime

from srbval.report.findings.findings import Evidence
from srbval.report.model import Report
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
from srbval.report.sections.table6 import table6_section, verdict_box, verdict_scan_section
from srbval.storage.stored_result import (
    CAMPAIGN_SCALE,
    NOISE_STUDY,
    OWN_VERDICTS,
    READING,
    RIG_SPEED_ACCURACY,
    RIG_STABILITY,
    SPEED_ACCURACY,
    STABILITY,
    VERDICT_SCAN,
    WATERFALL,
)
from srbval.storage.strict_json import json_object
from srbval.studies.noise.page import campaign_section
from srbval.studies.reading_accuracy.page import reading_section
from srbval.studies.rig_inputs.page import rig_scene_section
from srbval.studies.speed_accuracy.page import speed_accuracy_section
from srbval.studies.stability.page import stability_section
from srbval.studies.waterfall.page import waterfall_section


def assemble(evidence: Evidence, *, command: str) -> Report:
    """Build the report; `command` is the one that makes it again."""
    results, default = evidence.results, evidence.runs["paper-outer"].scene.solver
    origin = {"command": command, **evidence.provenance}
    verdict = verdict_box(evidence)
    headline = {"text": verdict.headline} | json_object(evidence.headline)
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model, Giraudo et al. (Sensors 25, 2419, 2025) and recordings of their rig",
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=(
            records_section(evidence),
            table6_section(evidence),
            speed_or_slip_section(evidence),
            figures_section(evidence),
            waterfall_section(results[WATERFALL]),
            rig_scene_section(evidence),
            speed_accuracy_section(results[SPEED_ACCURACY], results[RIG_SPEED_ACCURACY], default),
            stability_section(results[STABILITY], results[RIG_STABILITY], results[OWN_VERDICTS], default),
            ladder_section(evidence),
            limits_section(evidence),
            glossary_section(),
            # from here on the appendix alone, but for the command
            bearing_section(evidence),
            *((paper_speed_section(evidence),) if evidence.measured_states else ()),
            band_section(evidence),
            reading_section(results[READING]),
            matrix_section(evidence),
            verdict_scan_section(results[VERDICT_SCAN]),
            *other_rigs_section(evidence),
            campaign_section(results[NOISE_STUDY], results[CAMPAIGN_SCALE]),
            assumptions_section(evidence),
            failures_section(evidence),
            runs_section(evidence),
            scene_section(evidence),
            provenance_section(origin),
            references_section(evidence),
        ),
        data=evidence.to_dict() | {"headline": headline, "provenance": origin},
    )
