"""Put the report together; and what its answer rests on: bearing, what is open, words, failures, runs, sources."""

from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from srbval.comparison.budget import Answer
from srbval.comparison.matrix import NOT_DETECTED
from srbval.models.run import USABLE
from srbval.report.blocks import Badge, Command, KeyValues, Listing, Report, Section, Value
from srbval.report.figures.signals import load_zone_panel
from srbval.report.findings.findings import Findings
from srbval.report.findings.provenance import TIMED
from srbval.report.pages import Page, in_order, joined_data
from srbval.report.section_texts import Texts
from srbval.report.sections.figures import figures_section
from srbval.report.sections.records import band_section, matrix_section, records_section
from srbval.report.sections.table6 import cage_ratio_section, speed_or_slip_section, table6_section, verdict_box
from srbval.storage.json_files import to_json

BEARING, ASSUMPTIONS, LIMITS, GLOSSARY = Texts("bearing"), Texts("assumptions"), Texts("limits"), Texts("glossary")
FAILURES, RUNS, SCENE = Texts("failures"), Texts("runs"), Texts("scene")
PROVENANCE, REFERENCES = Texts("provenance"), Texts("references")
PAPER_WALL_PER_S = 86_400 / 1.26  # section 2.3: 1.26 simulated seconds per day
MAIN_FACTS = ("srbval", "git_revision", "python", "machine.system", "seeds")  # of the provenance, in the main document
SHOWN_DIGITS = 12  # of a scene's values: beyond them stands the rounding of a conversion of units


def assemble(findings: Findings, *, command: str, pages: Iterable[Page] = ()) -> Report:
    """Build the report with the `pages` of studies in it; `command` is the one that makes it again."""
    pages = tuple(pages)
    origin = {"command": command, **findings.provenance}
    verdict = verdict_box(findings)
    sources = (*REFERENCES.listing("papers").items, *REFERENCES.each("recordings", findings.datasets))
    placed = (
        (5, cage_ratio_section(findings)),
        (10, records_section(findings)),
        (20, table6_section(findings)),
        (30, speed_or_slip_section(findings)),
        (40, figures_section(findings)),
        (60, _limits(findings)),
        (70, GLOSSARY.section(GLOSSARY.listing("words"))),
        # from here on the appendix alone, but for the command
        (80, _bearing(findings)),
        (100, band_section(findings)),
        (110, matrix_section(findings)),
        (130, _assumptions(findings)),
        (140, _failures(findings)),
        (150, _runs(findings)),
        (160, SCENE.section(appendix=(SCENE.paragraph("intro"), KeyValues(pairs=flatten(findings.data["scene"]))))),
        (170, provenance_section(origin)),
        (180, REFERENCES.section(appendix=(Listing(sources),))),
        *((page.place, page.section(findings.results)) for page in pages),
    )
    data = joined_data(findings.data, (page.data(findings.results) for page in pages))
    headline = {"text": verdict.headline} | to_json(findings.headline)
    return Report(
        title="Simulated against measured: SKF 22240 spherical roller bearing",
        subtitle="The bundled multibody model, Giraudo et al. (Sensors 25, 2419, 2025) and recordings of their rig",
        generated_utc=datetime.now(UTC),
        verdict=verdict,
        sections=in_order(placed),
        data=data | {"headline": headline, "provenance": origin},
    )


def _bearing(findings: Findings) -> Section:
    """What the simulated bearing is and how it carries its load."""
    zone, scene = findings.load_zone, findings.runs["paper-outer"].scene
    figure = BEARING.figure("load-zone", load_zone_panel(zone=zone), badge=Badge.SIMULATED, scene=scene, zone=zone)
    return BEARING.section(appendix=(BEARING.paragraph("intro"), figure))


def _assumptions(findings: Findings) -> Section:
    """What the paper leaves open, and how the load divides; what it does stands with the matrix."""
    scene = findings.runs["paper-outer"].scene
    listed = ASSUMPTIONS.listing(
        "assumptions", geometry=findings.bearing.geometry, contact=scene.contact, defect=scene.defect,
        bodies=scene.bodies,
    )  # fmt: skip
    return ASSUMPTIONS.section(appendix=(listed, ASSUMPTIONS.paragraph("load-path", path=findings.data["load_path"])))


def _limits(findings: Findings) -> Section:
    """What nothing in this report says anything about."""
    missed = [one for one in findings.headline.stated if one.verdict is Answer.MISSED]
    passing = findings.data["point_passing"]
    rows = findings.matrix.comparisons
    return LIMITS.section(
        LIMITS.listing(
            "limits", passing=passing, missed=missed, combs=findings.results.content("rig_bands").get("combs", ()),
            blind=list(dict.fromkeys(Path(row.record).name for row in rows if row.used_for == "blind")),
            outcome=findings.results.content("prediction_outcome"),
            axial=any(cell.axial_kn for cell in findings.matrix.cells if cell.comparisons),
        )
    )  # fmt: skip


def _failures(findings: Findings) -> Section:
    """One line per failure; those of stored results by their number, since their sections name each."""
    failed = [run for run in findings.run_facts if run["status"] not in USABLE]
    unusable = [(Path(file).name, why) for file, why in findings.matrix.unusable]
    cells = findings.matrix.cells
    summary = FAILURES.listing(
        "summary",
        failed_runs=failed,
        runs=len(findings.run_facts),
        undetected=[Path(cell.file).name for cell in cells if cell.verdict == NOT_DETECTED],
        cells=len(cells),
    )
    items = (*FAILURES.each("run", failed), *FAILURES.each("record", unusable), *summary.items)
    return FAILURES.section(appendix=(FAILURES.paragraph("intro"), Listing(items)))


def _runs(findings: Findings) -> Section:
    """Every run behind the report: how it ended and what it cost."""
    slowest = max(run[TIMED] for run in findings.run_facts)
    cost = RUNS.paragraph("cost", paper_wall_per_s=PAPER_WALL_PER_S, slowest=slowest)
    return RUNS.section(appendix=(RUNS.table("runs-table", findings.run_facts), cost))


def provenance_section(origin: Mapping[str, Any]) -> Section:
    """The command that makes the report again and what it was made with; in the appendix libraries, machine, hashes."""
    flat = {key: ", ".join(map(str, v)) if isinstance(v, list) else v for key, v in flatten(origin).items()}
    command = str(flat.pop("command"))
    brief = {key: flat[key] for key in MAIN_FACTS if key in flat} | {
        "recordings": ", ".join(origin.get("recordings", ()))
    }
    shown = KeyValues(pairs={key: value for key, value in brief.items() if value})
    return PROVENANCE.section(PROVENANCE.paragraph("again"), Command(command), shown, appendix=(KeyValues(pairs=flat),))


def flatten(table: Mapping[str, Any], prefix: str = "") -> dict[str, Value]:
    """A nested table with dotted keys."""
    flat: dict[str, Value] = {}
    for key, value in table.items():
        if isinstance(value, Mapping):
            flat |= flatten(value, f"{prefix}{key}.")
        else:
            flat[prefix + key] = float(f"{value:.{SHOWN_DIGITS}g}") if isinstance(value, float) else value
    return flat
