"""Where each method fails, from the stored stability maps of the paper's scenes and of the rig's."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from srbval.models.run import USABLE, RunStatus
from srbval.report.blocks import Badge, Block, Figure, Listing, Section, Tone
from srbval.report.pages import Page, StoredResults, missing, origin_of
from srbval.report.section_texts import Texts
from srbval.scene import SolverSettings, paper_scene
from srbval.studies.scenes import RIG_SCENES
from srbval.studies.stability.claims import claims
from srbval.studies.stability.figure import stability_map

TEXTS = Texts.of_study(__package__)
CLAIM_TONE = {True: Tone.GOOD, False: Tone.BAD, None: Tone.NEUTRAL}
WITHIN = tuple(status for status in USABLE if status != RunStatus.INACCURATE)  # the tolerances
Row = Mapping[str, Any]
NAMES = ("stability", "rig_stability")  # the results, of the paper's scenes and of the rig's


def section(results: StoredResults) -> Section:
    """The paper's claims; in the appendix the maps, the limits and what the runs did not notice."""
    result, rig = results.get(NAMES[0]), results.get(NAMES[1])
    if result is None:
        return TEXTS.section(missing(NAMES[0]))
    content = result.content
    cells, grid, references = (content[name] for name in ("cells", "grid", "references"))
    tested: list[dict[str, Any]] = [
        {"claim": claim, "counted": TEXTS.text("counted", claim=claim)} for claim in claims(cells)
    ]
    outcomes = TEXTS.listing(
        "outcomes",
        default=_default(cells, paper_scene().solver),
        counts=content["counts"],
        planted=content["planted"],
        references=references,
        unlike=[c for c in cells if c["status"] == "unlike-reference"],
    )
    blocks: list[Block] = [
        origin_of(result),
        TEXTS.paragraph(
            "how", grid=grid, reference_error=max(max(r["own_cage_error"], r["own_load_error"]) for r in references)
        ),
    ]
    blocks += [TEXTS.callout("claim", tone=CLAIM_TONE[one["claim"]["borne_out"]], **one) for one in tested]
    blocks += [*_maps(content, "stability-limits"), outcomes]
    if rig is not None:
        blocks += [TEXTS.paragraph("rig", counts=rig.content["counts"]), origin_of(rig)]
        blocks += _maps(rig.content, "rig-stability-limits")
    return TEXTS.section(
        TEXTS.paragraph("intro", grid=grid, counts=content["counts"]),
        Listing(items=tuple(TEXTS.text("claim", **one) for one in tested)),
        appendix=blocks,
    )


def _maps(content: Row, table: str) -> Iterator[Block]:
    """Every method at every friction, scene by scene, and the limits of all."""
    grid = content["grid"]
    wanted = [[(s, v) for v in sorted(grid["critical_velocity_m_s"])] for s in grid["solvers"]]
    yield from (_map(content, scene, f"stability-{scene}", wanted) for scene in grid["scenes"])
    scenes = list(dict.fromkeys(c["scene"] for c in content["cells"]))
    yield TEXTS.table(table, _limits(content["cells"], scenes), scenes=scenes)


def _map(content: Row, scene: str, name: str, wanted: Sequence[Sequence[tuple[str, float]]]) -> Figure:
    """The map of a scene with a block for each of the methods and frictions wanted, rows of them."""
    cells = {
        (c["solver"], c["critical_velocity_m_s"], _steps(c), c["rpm"]): c
        for c in content["cells"]
        if c["scene"] == scene
    }
    steps, rpm = sorted(content["grid"]["steps_per_s"], reverse=True), sorted(content["grid"]["rpm"])
    several = scene not in RIG_SCENES and len({velocity for row in wanted for _, velocity in row}) > 1

    def block(solver: str, velocity: float) -> tuple[str, list[list[Row]]]:
        title = f"{solver}, critical velocity {_velocity(velocity)}" if several else solver
        return title, [[cells[solver, velocity, n, r] for r in rpm] for n in steps]

    blocks = [[block(*one) for one in row] for row in wanted]
    good = [
        {"title": title, "good": [sum(c["status"] in WITHIN for c in line) for line in lines]}
        for row in blocks for title, lines in row
    ]  # fmt: skip
    return TEXTS.figure(
        "stability", stability_map(blocks), id=name, badge=Badge.SIMULATED, scene=scene, blocks=good,
        steps=steps, speeds=len(rpm),
    )  # fmt: skip


def _limits(cells: Sequence[Row], scenes: Sequence[str]) -> Iterator[dict[str, Any]]:
    """For each method and scene: the longest step with every run ok, and what linear theory gives [divisors of 1 s]."""
    for solver, velocity in dict.fromkeys((c["solver"], c["critical_velocity_m_s"]) for c in cells):
        own = [c for c in cells if (c["solver"], c["critical_velocity_m_s"]) == (solver, velocity)]
        of_scenes = {}
        for scene in scenes:
            rows = [c for c in own if c["scene"] == scene]
            of_scenes[scene] = {
                "ok": _longest(rows, {_steps(c) for c in rows if c["status"] not in WITHIN}),
                "stable": _longest(rows, {_steps(c) for c in rows if not c["stable"]}),
                "elastic_limit": _least(c["predicted_elastic_limit_dt_s"] for c in rows),
                "limit": _least(c["predicted_limit_dt_s"] for c in rows),
            }
        name = solver if own[0]["scene"] in RIG_SCENES else f"{solver}, {_velocity(velocity)}"
        yield {"method": name, "scenes": of_scenes}


def _velocity(m_s: float) -> str:
    return f"{m_s:g} m/s" if m_s >= 0.1 else f"{1e3 * m_s:g} mm/s"


def _steps(cell: Row) -> int:
    return round(1 / cell["dt_s"])


def _longest(cells: Sequence[Row], bad: set[int]) -> float | None:
    """Divisor of the longest step such that neither it nor a shorter one is among the `bad` ones."""
    good = [steps for steps in {_steps(c) for c in cells} if steps > max(bad, default=0)]
    return float(min(good)) if good else None


def _least(limits_s: Iterable[float | None]) -> float | None:
    known = [limit for limit in limits_s if limit is not None]
    return 1 / min(known) if known else None


def _default(cells: Sequence[Row], solver: SolverSettings) -> str:
    """How the default solver fares at its default step."""
    own = [c for c in cells if c["solver"] == solver.name and math.isclose(c["dt_s"], solver.step_s, rel_tol=1e-6)]
    failed = [c for c in own if c["status"] not in WITHIN]
    good = len(own) - len(failed)
    return TEXTS.text("default", solver=solver, own=own, good=good, failed=failed, velocity=_velocity)


PAGE = Page(
    name="stability", place=48, results=NAMES, section=section,
    data=lambda results: {"stability": [cell for name in NAMES for cell in results.content(name).get("cells", [])]},
)  # fmt: skip
