"""What the answer rests on: the bearing, what is open, words, failures, runs, scene, provenance, sources."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from srbval.comparison.matrix import NOT_DETECTED
from srbval.models.run import USABLE
from srbval.report.blocks import Badge, Command, FigureGrid, KeyValues, Listing, Value
from srbval.report.figures.bearing import axial_section, bearing_scene, defect_cloud, load_zone, whole_bearing
from srbval.report.findings.findings import Findings
from srbval.report.findings.provenance import TIMED
from srbval.report.model import Section
from srbval.report.section_texts import Texts

BEARING = Texts("bearing")
ASSUMPTIONS, LIMITS, FAILURES, RUNS = Texts("assumptions"), Texts("limits"), Texts("failures"), Texts("runs")
SCENE, PROVENANCE, REFERENCES = Texts("scene"), Texts("provenance"), Texts("references")
GLOSSARY = Texts("glossary")
PAPER_WALL_PER_S = 86_400 / 1.26  # section 2.3: 1.26 simulated seconds per day
SHOWN_DIGITS = 12  # of a scene's values: beyond them stands the rounding of a conversion of units


def bearing_section(findings: Findings) -> Section:
    """What the simulated bearing looks like, where its defect and its load are: the paper's Figures 1, 5 and 8."""
    scene, views, geometry = findings.runs["paper-outer"].scene, findings.bearing_views, findings.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    whole = whole_bearing(geometry=geometry, views=views, defect_rad=scene.load.zone_rad + scene.defect.angle_rad)
    along = bearing_scene(scene=scene, geometry=geometry, zone=views.load_zone)
    pair = (
        BEARING.figure("bearing-whole", whole, suffix=".png", rollers=len(views.slot_angle_rad)),
        BEARING.figure("bearing-scene", along, badge=Badge.SIMULATED, geometry=geometry),
    )
    return BEARING.section(
        appendix=(
            BEARING.paragraph("intro"),
            BEARING.figure("bearing-section", axial_section(geometry=geometry, circles=views.circles)),
            FigureGrid(figures=pair, columns=2),
            BEARING.figure(
                "defect-cloud", defect_cloud(views=views), badge=Badge.SIMULATED, scene=scene,
                defect=scene.defect, spacing_m=views.spacing_m,
            ),
            BEARING.figure(
                "load-zone", load_zone(zone=views.load_zone), badge=Badge.SIMULATED, scene=scene,
                zone=views.load_zone,
            ),
        )
    )  # fmt: skip


def assumptions_section(findings: Findings) -> Section:
    """What the paper leaves open, and how the load divides; what it does stands with the matrix."""
    scene, geometry = findings.runs["paper-outer"].scene, findings.bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    listed = ASSUMPTIONS.listing(
        "assumptions", geometry=geometry, contact=scene.contact, defect=scene.defect, bodies=scene.bodies
    )
    return ASSUMPTIONS.section(appendix=(listed, ASSUMPTIONS.paragraph("load-path", path=findings.data["load_path"])))


def limits_section(findings: Findings) -> Section:
    """What nothing in this report says anything about."""
    studies = findings.results.content("rig_inputs").get("studies", ())
    second = [record.analysis.recording for record in findings.kurtograms if record.second_comb]
    items = LIMITS.listing("limits", passing=findings.data["point_passing"], second=second, studies=studies)
    return LIMITS.section(items)


def glossary_section() -> Section:
    """The words that the report uses, each in a sentence."""
    return GLOSSARY.section(GLOSSARY.listing("words"))


def failures_section(findings: Findings) -> Section:
    """One line per failure; those of stored results by their number, since their sections name each."""
    failed = [run for run in findings.run_facts if run["status"] not in USABLE]
    unusable = [(Path(file).name, why) for file, why in findings.matrix.unusable]
    cells, other_rigs = findings.matrix.cells, findings.data["other_rigs"]
    summary = FAILURES.listing(
        "summary",
        failed_runs=failed,
        runs=len(findings.run_facts),
        undetected=[Path(cell.file).name for cell in cells if cell.verdict == NOT_DETECTED],
        cells=len(cells),
        refused=sum(bool(record.refused) for record in other_rigs),
        other_rigs=len(other_rigs),
    )
    items = (
        *(item for run in failed for item in FAILURES.listing("run", run=run).items),
        *(item for file, why in unusable for item in FAILURES.listing("record", file=file, why=why).items),
        *summary.items,
    )
    return FAILURES.section(appendix=(FAILURES.paragraph("intro"), Listing(items=items)))


def runs_section(findings: Findings) -> Section:
    """Every run behind the report: how it ended and what it cost."""
    slowest = max(run[TIMED] for run in findings.run_facts)
    cost = RUNS.paragraph("cost", paper_wall_per_s=PAPER_WALL_PER_S, slowest=slowest)
    return RUNS.section(appendix=(RUNS.table("runs-table", findings.run_facts), cost))


def scene_section(findings: Findings) -> Section:
    """Every value of the paper's outer-race scene, SI units in the names."""
    return SCENE.section(appendix=(SCENE.paragraph("intro"), KeyValues(pairs=flatten(findings.data["scene"]))))


def provenance_section(origin: Mapping[str, Any]) -> Section:
    """The command that makes the report again; in the appendix versions, machine, seeds and recordings."""
    flat = {key: ", ".join(map(str, v)) if isinstance(v, list) else v for key, v in flatten(origin).items()}
    command = str(flat.pop("command"))
    again = PROVENANCE.paragraph("again")
    return PROVENANCE.section(again, Command(command), appendix=(KeyValues(pairs=flat),))


def references_section(findings: Findings) -> Section:
    """Papers first, then the data sets of the recordings that were read."""
    sets = (REFERENCES.listing("recordings", set=description) for description in findings.datasets.values())
    papers = REFERENCES.listing("papers").items
    items = (*papers, *(item for listing in sets for item in listing.items))
    return REFERENCES.section(appendix=(Listing(items=items),))


def flatten(table: Mapping[str, Any], prefix: str = "") -> dict[str, Value]:
    """A nested table with dotted keys."""
    flat: dict[str, Value] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = float(f"{value:.{SHOWN_DIGITS}g}") if isinstance(value, float) else value
    return flat
