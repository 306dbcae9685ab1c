"""Put the report together from the evidence."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.evidence.gather import Evidence
from srbval.report.blocks import Command, KeyValues, Listing, Paragraph
from srbval.report.content.band_figure import band_figure
from srbval.report.content.band_section import band_section
from srbval.report.content.bearing_section import bearing_section
from srbval.report.content.campaign_section import campaign_section
from srbval.report.content.failures_section import failures_section
from srbval.report.content.ladder_section import ladder_data, ladder_section
from srbval.report.content.matrix_section import matrix_section
from srbval.report.content.open_section import open_section
from srbval.report.content.other_rigs_section import other_rigs_section
from srbval.report.content.panels import Side, figures_11_to_14, model_alone
from srbval.report.content.peaks_table import peaks_table
from srbval.report.content.provenance import provenance
from srbval.report.content.reading_section import reading_section
from srbval.report.content.references_section import references_section
from srbval.report.content.runs_section import flatten, runs_section, scene_section
from srbval.report.content.scalogram_checks import checks_table
from srbval.report.content.scene_figure import scene_figure, table6_figure
from srbval.report.content.sidebands import sideband_remark
from srbval.report.content.sources_section import sources_section
from srbval.report.content.speed_accuracy_section import speed_accuracy_section
from srbval.report.content.speed_and_slip_section import speed_and_slip_section
from srbval.report.content.stability_section import stability_section
from srbval.report.content.sum_rule_section import sum_rule_section
from srbval.report.content.table6_section import table6_section
from srbval.report.content.verdict_box import verdict_box
from srbval.report.model import Report, Section
from srbval.storage.stored_result import (
    CAMPAIGN_SCALE,
    NOISE_STUDY,
    READING,
    SENSITIVITY,
    SPEED_ACCURACY,
    STABILITY,
    StoredResult,
    newest_result,
)
from srbval.validation.bias import biases, pairs
from srbval.validation.cross_band import CrossBand, cross_bands

SCHEMA_VERSION = 1


def assemble(evidence: Evidence, figures: Path, *, command: str) -> Report:
    """Draw the figures into `figures` and build the report; `command` is the one that makes it again."""
    origin = provenance(evidence, command)
    crossed = cross_bands(evidence.beside_rig, evidence.rig)
    kinds = (SPEED_ACCURACY, STABILITY, NOISE_STUDY, CAMPAIGN_SCALE, READING, SENSITIVITY)
    kept = {kind: newest_result(kind) for kind in kinds}
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model beside Giraudo et al. (Sensors 25, 2419, 2025) and recordings of its rig",
        generated_utc=datetime.now(UTC),
        verdict=verdict_box(evidence),
        sections=(
            sources_section(evidence),
            bearing_section(evidence, scene_figure(evidence, figures), figures),
            table6_section(evidence, table6_figure(evidence, figures)),
            sum_rule_section(evidence),
            speed_and_slip_section(evidence),
            _figures_section(evidence, figures),
            band_section(evidence, crossed, figures),
            *_paper_speed_section(evidence, figures),
            speed_accuracy_section(kept[SPEED_ACCURACY], figures),
            stability_section(kept[STABILITY], figures),
            reading_section(kept[READING]),
            ladder_section(figures),
            campaign_section(kept[NOISE_STUDY], kept[CAMPAIGN_SCALE]),
            matrix_section(evidence, figures),
            *other_rigs_section(evidence),
            open_section(evidence),
            _limits_section(evidence),
            failures_section(evidence, kept),
            runs_section(evidence),
            scene_section(evidence),
            _provenance_section(origin),
            references_section(evidence),
        ),
        data=_data(evidence, origin, kept, crossed),
    )


def _figures_section(evidence: Evidence, folder: Path) -> Section:
    model, rig = Side(analyses=evidence.beside_rig), Side(analyses=evidence.rig)
    figure_11, figure_12, figure_13, figure_14 = figures_11_to_14(model, rig, folder)
    return Section(
        id="figures",
        title="Figures 11 to 14: model and rig",
        blocks=(
            Paragraph(
                "Panel letters are the paper's: (a, c, e) the model, (b, d, f) the rig. Where a measured recording is "
                "registered, the model beside it runs at that recording's own tachometer speed. A blow at every "
                "passage of the defect excites the structure; the band-pass keeps where it rings, the **envelope** is "
                "the outline of that ringing, and the envelope's spectrum shows how often it starts anew. All signals "
                "are divided by their own standard deviation first."
            ),
            band_figure(model.analyses, rig.analyses, folder),
            figure_11,
            figure_12,
            peaks_table("12", Fault.OUTER, model.analyses[Fault.OUTER], rig.analyses[Fault.OUTER]),
            figure_13,
            peaks_table("13", Fault.INNER, model.analyses[Fault.INNER], rig.analyses[Fault.INNER]),
            sideband_remark(evidence),
            figure_14,
            checks_table(rig.scalogram_window(Fault.OUTER)),
        ),
    )


def _paper_speed_section(evidence: Evidence, folder: Path) -> tuple[Section, ...]:
    if not evidence.measured_states:
        return ()
    rpm = evidence.printed.shaft_rpm
    return (
        Section(
            id="figures-paper-speed",
            title=f"The model at the paper's own {rpm:g} rpm",
            blocks=(
                Paragraph(
                    f"No recording of the rig at {rpm:g} rpm is open, so these panels of Figures 11 to 13 stand alone."
                ),
                *model_alone(Side(analyses=evidence.paper), folder),
            ),
        ),
    )


def _limits_section(evidence: Evidence) -> Section:
    return Section(
        id="limits",
        title="What is not validated",
        blocks=(
            Listing(
                items=(
                    "**Amplitudes.** The paper did not seek to match them; neither does this report. Every signal is "
                    "normalised.",
                    "**Rolling-element defects, axial load, speed and load over time, gravity** can "
                    "be simulated but are not compared with anything here. **Lubrication** is not modelled.",
                    "**The noise floor of the simulated spectra.** What the time integration adds to it stands in "
                    "the section on speed against accuracy; explicit methods make their friction chatter, and most of "
                    "their floor is numerical. Fault lines are read well above either.",
                    "**Any other bearing.** A TOML file runs one of your own; nothing in this report is about it, and "
                    "each of its runs says so.",
                    _point_passing(evidence),
                )
            ),
        ),
    )


def _point_passing(evidence: Evidence) -> str:
    run = evidence.runs["paper-healthy"]
    points, shaft_hz = run.scene.contact.points_per_circle, run.scene.shaft_hz
    outer, inner = points * run.cage_ratio * shaft_hz, points * (1 - run.cage_ratio) * shaft_hz
    return (
        f"**Point passing**: the raceways are {points} points a circle, which excites {outer / 1e3:.1f} and "
        f"{inner / 1e3:.1f} kHz at {60 * shaft_hz:.0f} rpm. These are numerical and lie above the simulated band."
    )


def _provenance_section(origin: dict[str, Any]) -> Section:
    flat = {k: ", ".join(map(str, v)) if isinstance(v, list) else v for k, v in flatten(origin).items()}
    return Section(
        id="provenance",
        title="Provenance",
        blocks=(
            Paragraph("The command that makes this report again:"),
            Command(origin["command"]),
            KeyValues(pairs={k: v for k, v in flat.items() if k != "command"}),
        ),
    )


def _data(
    evidence: Evidence, origin: dict[str, Any], kept: Mapping[str, StoredResult | None], crossed: tuple[CrossBand, ...]
) -> dict[str, Any]:
    """What becomes ``report.json``; `figures` is filled from the tree by the writer."""
    measured, mapped = kept[SPEED_ACCURACY], kept[STABILITY]
    analyses = {
        f"{group}-{state}": analysis
        for group, side in (
            ("paper", evidence.paper),
            ("beside-rig", evidence.beside_rig),
            ("rig", evidence.rig),
        )
        for state, analysis in side.items()
    }
    return {
        "schema_version": SCHEMA_VERSION,
        "status": "ok",
        "table6": list(evidence.rows),
        "closure": list(evidence.sums),
        "comparisons": list(evidence.comparisons),
        "bias": [dataclasses.asdict(row) for row in biases(pairs(evidence.matrix.cells))],
        "sensitivity": [dataclasses.asdict(effect) for effect in evidence.known.effects],
        "variations": [dataclasses.asdict(v) for v in evidence.variations],
        "analyses": analyses,
        "speed_accuracy": measured.content["runs"] if measured else [],
        "stability": mapped.content["cells"] if mapped else [],
        "kept_results": {kind: result.origin for kind, result in kept.items() if result},
        "ladder": ladder_data(),
        "detection_under_noise": _content(kept[NOISE_STUDY]).get("rows", []),
        "reading": {key: _content(kept[READING]).get(key, []) for key in ("accuracy", "false_alarms", "timings")},
        "campaign_scale": _content(kept[CAMPAIGN_SCALE]).get("reckoned", []),
        "matrix": list(evidence.matrix.cells),
        "crossed_bands": list(crossed),
        "other_rigs": list(evidence.other_rigs),
        "speed_and_slip": list(evidence.slips),
        "recordings": evidence.registered,
        "provenance": origin,
    }


def _content(kept: StoredResult | None) -> dict[str, Any]:
    return kept.content if kept else {}
