"""What the paper leaves open, what was assumed, and what each reading does to the result."""

from __future__ import annotations

import math

from srbval.evidence.gather import Evidence
from srbval.report.blocks import Block, Listing, Paragraph
from srbval.report.model import Section
from srbval.report.table import Column, Table


def open_section(evidence: Evidence) -> Section:
    """Assumptions, variations and the load path."""
    return Section(
        id="assumptions",
        title="What the paper leaves open",
        blocks=(_assumptions(evidence), _variations(evidence), *_load_path(evidence)),
    )


def _assumptions(evidence: Evidence) -> Block:
    scene = evidence.runs["paper-outer"].scene
    geometry = evidence.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    contact, defect = scene.contact, scene.defect
    return Listing(
        items=(
            f"**Pitch**: Table 1's d_p = {geometry.pitch_radius_m * 1e3:g} mm is the pitch **radius**; as a diameter "
            "it would "
            "not give the printed frequencies.",
            "**Equation 17**: the inner raceway's radius is C_x **minus** R_x cos(p alpha); the printed plus would "
            "put the "
            "inner raceway outside the outer one.",
            f"**Roller diameter**: {geometry.zero_play_diameter_m * 1e3:.3f} mm, just touching (Table 4: radial play "
            "0). "
            f"Table 1 prints {geometry.roller_diameter_m * 1e3:g} mm, an interference of "
            f"{(geometry.roller_diameter_m - geometry.zero_play_diameter_m) / 2 * 1e3:.3f} mm at each contact; both "
            "readings "
            "are compared below.",
            f"**Critical velocity of friction**: {contact.critical_velocity_m_s * 1e3:g} mm/s. The paper is silent; "
            "this is the "
            "default of its simulation software. Below it friction rises linearly to its static value, above it falls "
            "to "
            "the dynamic one at 1.5 times that velocity.",
            "**Normal force**: equation 18, but never pulling: where damping would make it negative it is zero.",
            f"**Defect**: {defect.points} neighbouring points of the middle circle of one row, raised by "
            f"{defect.height_m * 1e3:g} mm (Figure 5's example; Table 4 gives only the number), in the middle of the "
            "load zone "
            "at time zero. Every figure and table here uses this height.",
            f"**Cage**: {scene.bodies.cage_mass_kg:g} kg, a thin ring at the pitch radius; **outer ring**: its mass "
            "from its "
            "boundary dimensions. The paper gives neither.",
            "**Directions**: the load pushes the outer ring down; the sensor stands at 45 degrees between the axes.",
            "**No gravity**, no lubricant, no contact between roller and cage pocket, as in the paper.",
        )
    )


def _variations(evidence: Evidence) -> Table:
    base = evidence.runs["paper-outer"]
    rows: list[list[str | float | None]] = [
        [
            "as simulated here",
            "outer",
            base.cage_ratio,
            base.bpfo_hz,
            base.bpfi_hz,
            0.0,
            base.roller_load_share * 100,
        ]
    ]
    rows += [
        [v.purpose, v.state, v.cage_ratio, v.bpfo_hz, v.bpfi_hz, v.bpfo_change_pct, v.roller_load_share * 100]
        for v in evidence.variations
    ]
    return Table(
        id="variations",
        label="One change at a time",
        caption="What each open choice does to the cage speed, and so to Table 6, at "
        f"{evidence.printed.shaft_rpm:g} rpm.",
        columns=(
            Column(title="Change"),
            Column(title="Defect"),
            Column(title="Cage / shaft", format=".5f"),
            Column(title="BPFO", unit="Hz", format=".3f"),
            Column(title="BPFI", unit="Hz", format=".3f"),
            Column(title="BPFO changes by", unit="%", format="+.3f"),
            Column(title="Load on rollers", unit="%", format=".1f"),
        ),
        rows=rows,
        notes=(
            "Lines from the mean cage speed: BPFO = Z f_c, BPFI = Z (f_r - f_c). The three circles of a raceway have "
            "different "
            "rolling radii, so they cannot all roll: friction decides where the cage settles.",
        ),
    )


def _load_path(evidence: Evidence) -> list[Block]:
    run = evidence.runs["paper-healthy"]
    load = run.scene.load
    share = run.roller_load_share
    spring = math.hypot(*(run.displacement_m.mean(axis=0))) * run.scene.housing.stiffness_n_m
    return [
        Paragraph(
            f"**Load path.** In the paper's model the external {load.radial_n / 1e3:g} kN acts on the outer ring, "
            "which also "
            f"hangs on the housing spring K_h. So the spring carries {spring / 1e3:.1f} kN and the rollers only "
            f"{share * load.radial_n / 1e3:.1f} kN ({100 * share:.1f} %) in the healthy run. With the load path set "
            "to `bearing` "
            "in a scene file the rollers carry all of it."
        )
    ]
