"""Where each method fails, from the stored stability maps of the paper's scenes and of the rig's."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from srbval.models.run import USABLE, RunStatus
from srbval.report.blocks import Badge, Block, Figure, Listing, Section, Tone
from srbval.report.pages import Page, StoredResults
from srbval.report.plain import literal
from srbval.report.section_texts import Texts, missing, origin_of
from srbval.scene import SolverSettings, paper_scene
from srbval.storage.stored_result import StoredResult
from srbval.studies.scenes import RIG_SCENES
from srbval.studies.stability.figure import MapBlock, stability_map

TEXTS = Texts.of_study(__package__)
MAIN_SCENE = "interference-outer"  # of the one map in the main document
BLOCKS_ABREAST = 4  # in it
CLAIM_TONE = {True: Tone.GOOD, False: Tone.BAD, None: Tone.NEUTRAL}
WITHIN = tuple(status for status in USABLE if status != RunStatus.INACCURATE)  # the tolerances
Row = Mapping[str, Any]
NAMES = ("stability", "rig_stability")  # the results, of the paper's scenes and of the rig's


def section(results: StoredResults) -> Section:
    """The paper's claims and one map; in the appendix all maps, limits and what the runs did not notice."""
    result, rig = results.get(NAMES[0]), results.get(NAMES[1])
    if result is None:
        return TEXTS.section(missing(NAMES[0]))
    content = result.content
    cells, grid, references = content["cells"], content["grid"], content["references"]
    scenes = list(dict.fromkeys(c["scene"] for c in cells))
    main_scene = MAIN_SCENE if MAIN_SCENE in grid["scenes"] else grid["scenes"][0]
    outcomes = TEXTS.listing(
        "outcomes",
        default=_default(cells, paper_scene().solver),
        counts=content["counts"],
        planted=content["planted"],
        references=references,
        unlike=[c for c in cells if c["status"] == "unlike-reference"],
    )
    reference_error = max(max(r["own_cage_error"], r["own_load_error"]) for r in references)
    return TEXTS.section(
        TEXTS.paragraph("intro", grid=grid, counts=content["counts"]),
        Listing(items=tuple(TEXTS.text("claim", claim=claim) for claim in content["claims"])),
        _main_map(content, main_scene),
        appendix=(
            origin_of(result),
            TEXTS.paragraph("how", grid=grid, reference_error=reference_error),
            *(block for claim in content["claims"] for block in _claim(claim)),
            *(_map(content, scene) for scene in grid["scenes"]),
            TEXTS.table("stability-limits", _limits(cells, scenes), scenes=scenes),
            outcomes,
            *(_rig(rig) if rig else ()),
        ),
    )


def _rig(result: StoredResult) -> Iterator[Block]:
    """Map and limits of the rig's scene."""
    cells, scenes = result.content["cells"], result.content["grid"]["scenes"]
    yield TEXTS.paragraph("rig", counts=result.content["counts"])
    yield origin_of(result)
    yield from (_map(result.content, scene) for scene in scenes)
    yield TEXTS.table("rig-stability-limits", _limits(cells, scenes), scenes=scenes)


def _claim(claim: Row) -> Iterator[Block]:
    yield TEXTS.callout("claim", tone=CLAIM_TONE[claim["borne_out"]], claim=claim)
    yield Listing(items=tuple(literal(line) for line in claim["evidence"]))


def _main_map(content: Mapping[str, Any], scene: str) -> Figure:
    """Every method at the paper's friction."""
    grid = content["grid"]
    velocity, solvers = min(grid["critical_velocity_m_s"]), grid["solvers"]
    rows = [solvers[i : i + BLOCKS_ABREAST] for i in range(0, len(solvers), BLOCKS_ABREAST)]
    return _drawn(content, scene, "stability-map", [[(solver, velocity) for solver in row] for row in rows])


def _map(content: Mapping[str, Any], scene: str) -> Figure:
    """Every method at every friction."""
    grid = content["grid"]
    wanted = [[(s, v) for v in sorted(grid["critical_velocity_m_s"])] for s in grid["solvers"]]
    return _drawn(content, scene, f"stability-{scene}", wanted)


def _drawn(content: Mapping[str, Any], scene: str, name: str, wanted: Sequence[Sequence[tuple[str, float]]]) -> Figure:
    """The map of a scene with a block for each of the methods and frictions wanted, rows of them."""
    grid = content["grid"]
    cells = {
        (c["solver"], c["critical_velocity_m_s"], round(1 / c["dt_s"]), c["rpm"]): c
        for c in content["cells"]
        if c["scene"] == scene
    }
    steps, rpm = sorted(grid["steps_per_s"], reverse=True), sorted(grid["rpm"])

    def block(solver: str, velocity: float) -> MapBlock:
        rows = [[cells[solver, velocity, n, r] for r in rpm] for n in steps]
        return MapBlock(
            title=f"{solver}, critical velocity {_velocity(velocity)}" if several else solver,
            statuses=[[c["status"] for c in row] for row in rows],
            limits_s=[(c["predicted_elastic_limit_dt_s"], c["predicted_limit_dt_s"]) for c in rows[0]],
        )

    several = scene not in RIG_SCENES and len({velocity for row in wanted for _, velocity in row}) > 1
    blocks = [[block(*one) for one in row] for row in wanted]
    plot = partial(stability_map, blocks=blocks, steps_per_s=steps, rpm=rpm)
    good = [
        {"title": b.title, "good": [sum(status in WITHIN for status in line) for line in b.statuses]}
        for b in (b for row in blocks for b in row)
    ]
    return TEXTS.figure(
        "stability", plot, id=name, badge=Badge.SIMULATED, scene=scene, blocks=good, steps=steps, speeds=len(rpm)
    )


def _limits(cells: Sequence[Row], scenes: Sequence[str]) -> Iterator[dict[str, Any]]:
    """For each method and scene: the longest step with every run ok, and what linear theory gives."""
    for solver, velocity in dict.fromkeys((c["solver"], c["critical_velocity_m_s"]) for c in cells):
        own = [c for c in cells if (c["solver"], c["critical_velocity_m_s"]) == (solver, velocity)]
        by_scene = {scene: [c for c in own if c["scene"] == scene] for scene in scenes}
        yield {
            "method": solver if own[0]["scene"] in RIG_SCENES else f"{solver}, {_velocity(velocity)}",
            "scenes": {
                scene: {
                    "ok": _longest(rows, lambda c: c["status"] in WITHIN),
                    "stable": _longest(rows, lambda c: bool(c["stable"])),
                    "elastic_limit": _per_s(rows, "predicted_elastic_limit_dt_s"),
                    "limit": _per_s(rows, "predicted_limit_dt_s"),
                }
                for scene, rows in by_scene.items()
            },
        }


def _velocity(m_s: float) -> str:
    return f"{m_s:g} m/s" if m_s >= 0.1 else f"{1e3 * m_s:g} mm/s"


def _longest(cells: Sequence[Row], good: Callable[[Row], bool]) -> float | None:
    """Divisor of the longest step such that it and all shorter ones are good at every speed."""
    found = None
    for steps in sorted({round(1 / c["dt_s"]) for c in cells}, reverse=True):
        if not all(good(c) for c in cells if round(1 / c["dt_s"]) == steps):
            break
        found = float(steps)
    return found


def _per_s(cells: Sequence[Row], name: str) -> float | None:
    least = min((c[name] for c in cells if c[name] is not None), default=math.inf)
    return 1 / least if math.isfinite(least) else None


def _default(cells: Sequence[Row], solver: SolverSettings) -> str:
    """How the default solver fares at its default step."""
    own = [c for c in cells if c["solver"] == solver.name and math.isclose(c["dt_s"], solver.step_s, rel_tol=1e-6)]
    failed = [c for c in own if c["status"] not in WITHIN]
    return TEXTS.text(
        "default", solver=solver, own=own, good=len(own) - len(failed), failed=failed, velocity=_velocity
    )  # fmt: skip


PAGE = Page(
    name="stability", place=48, results=NAMES, section=section,
    data=lambda results: {"stability": [cell for name in NAMES for cell in results.content(name).get("cells", [])]},
)  # fmt: skip
