"""What each solver costs on each scene, and whether points in contact set that cost or all points that exist."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from srbval.bench.contact_counts import count_contacts
from srbval.bench.measures import ratio_or_none
from srbval.bench.row import BenchRun, row_of
from srbval.bench.scenes import CONTACTS, PAPER_STEP_S, BenchSettings, bench_scene
from srbval.bench.timing import time_scene
from srbval.progress import Progress, silent
from srbval.scene import paper_scene

POINTS = (500, 1000, 2000, 4000)
HEALTHY = tuple(f"{contact}-healthy" for contact in CONTACTS)
# A shaft that hardly turns, rollers too small to touch: what the bodies' own motion costs.
NOTHING_TOUCHES = "nothing-touches"
SLOW_RAD_S, LOOSE_M = 1e-6, 3e-3


@dataclass(frozen=True, kw_only=True)
class ContactCost:
    """Cost of a healthy scene and what is in contact in it, see `ContactCounts` (None: the run failed).

    `us_per_step` is the best wall time of one step, `ns_per_point` the same per point in contact.
    """

    JSON_PROPERTIES: ClassVar = ("ns_per_point",)

    scene: str
    solver: str
    points_per_circle: int
    us_per_step: float | None
    touching_points: float | None = None
    touching_contacts: float | None = None
    touching_loaded_rollers: float | None = None

    @property
    def ns_per_point(self) -> float | None:
        """Wall time of a step per point in contact [ns]; None where nothing is in contact."""
        return ratio_or_none(None if self.us_per_step is None else 1e3 * self.us_per_step, self.touching_points)

    def contact_us(self, bodies_us: float) -> float | None:
        """Wall time of a step beyond `bodies_us`, per roller-race pair in contact [us]."""
        if self.us_per_step is None or not self.touching_contacts:
            return None
        return (self.us_per_step - bodies_us) / self.touching_contacts


def speed_rows(
    scenes: Sequence[str],
    solvers: Sequence[str],
    steps_s: Sequence[float],
    settings: BenchSettings,
    calibration_s: float,
    progress: Progress = silent,
) -> list[BenchRun]:
    """Time every solver at every step on every scene, one after another, each on one core."""
    rows = []
    every = [(scene, solver, step) for scene in scenes for solver in solvers for step in steps_s]
    for number, (name, solver, step) in enumerate(every):
        progress("time the solvers", number / len(every))
        fewer = min(1.0, step / PAPER_STEP_S)  # as many steps whatever the step
        scene = bench_scene(
            name, solver=solver, step_s=step,
            seconds=settings.timing_s * fewer, settle_s=settings.timing_settle_s * fewer,
        )  # fmt: skip
        rows.append(row_of(name, time_scene(scene, settings.repeats), calibration_s))
    progress("time the solvers", 1.0)
    return rows


def contact_costs(solver: str, settings: BenchSettings, progress: Progress = silent) -> list[ContactCost]:
    """Cost against points per circle, K_c n_pc and C_c n_pc constant, and with both roller fits; healthy scenes."""
    cases = [(HEALTHY[0], points) for points in POINTS] + [(HEALTHY[1], POINTS[0]), (NOTHING_TOUCHES, POINTS[0])]
    costs = []
    for number, (name, points) in enumerate(cases):
        progress("time more points", number / len(cases))
        costs.append(_contact_cost(name, points, solver, settings))
    progress("time more points", 1.0)
    return costs


def _contact_cost(name: str, points: int, solver: str, settings: BenchSettings) -> ContactCost:
    paper = paper_scene().contact
    fewer = paper.points_per_circle / points
    scene = bench_scene(
        HEALTHY[0] if name == NOTHING_TOUCHES else name,
        solver=solver, seconds=settings.timing_s, settle_s=settings.timing_settle_s,
        contact={"points_per_circle": points, "stiffness_n_m": paper.stiffness_n_m * fewer,
                 "damping_ns_m": paper.damping_ns_m * fewer},
    )  # fmt: skip
    if name == NOTHING_TOUCHES:
        scene = replace(
            scene, shaft_speed_rad_s=SLOW_RAD_S, load=replace(scene.load, radial_n=0.0),
            contact=replace(scene.contact, radial_play_m=LOOSE_M),
        )  # fmt: skip
    timed = time_scene(scene, settings.repeats)
    counts = vars(count_contacts(timed.run)) if timed.ok and timed.run is not None else {}
    return ContactCost(
        scene=name,
        solver=solver,
        points_per_circle=points,
        us_per_step=None if timed.timing is None else 1e6 * timed.timing.best * PAPER_STEP_S,
        **{f"touching_{name}": count for name, count in counts.items()},
    )
