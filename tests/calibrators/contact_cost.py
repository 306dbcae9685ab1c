"""Whether points in contact set a run's cost, or all points: ``python -m tests.calibrators.contact_cost``.

Prints the cost of a step over the points per circle, K_c n_pc and C_c n_pc constant, and with both roller fits, and two
ratios that should not exceed 1.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar

from srbval.bench.measures import ratio_or_none
from srbval.bench.scenes import CONTACTS, FULL, PAPER_STEP_S, BenchSettings, bench_scene
from srbval.bench.timing import time_scene
from srbval.progress import Progress, ProgressDisplay, silent
from srbval.scene import paper_scene
from srbval.storage.strict_json import json_object
from tests.calibrators.contact_counts import count_contacts
from tests.calibrators.rows import print_rows

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


def points_growth(costs: Sequence[ContactCost]) -> float | None:
    """Time per point in contact at the most points over that at the fewest; above 1, other points cost time too."""
    per_point = {c.points_per_circle: c.ns_per_point for c in costs if c.scene == HEALTHY[0]}
    few, many = per_point.get(POINTS[0]), per_point.get(POINTS[-1])
    return ratio_or_none(many, few)


def contact_cost_ratio(costs: Sequence[ContactCost]) -> float | None:
    """Contact time per pair in contact where few rollers are over that where all are; above 1, idle pairs cost too.

    Contact time is what a step takes beyond the bodies' own motion, timed where nothing is in contact.
    """
    own = {c.scene: c for c in costs if c.points_per_circle == POINTS[0]}
    bodies_us = own[NOTHING_TOUCHES].us_per_step if NOTHING_TOUCHES in own else None
    if bodies_us is None or not set(HEALTHY) <= set(own):
        return None
    some, every = (own[scene].contact_us(bodies_us) for scene in HEALTHY)
    return ratio_or_none(some, every)


def main() -> None:
    """Measure and print."""
    with ProgressDisplay() as progress:
        costs = contact_costs("ode4", FULL, progress)
    print_rows([json_object(cost) for cost in costs])
    growth = f"time over touching points, growth from {POINTS[0]} to {POINTS[-1]} points per circle"
    print(f"{growth}: {points_growth(costs):.3g}")
    print(f"contact time per touching roller and race, {HEALTHY[0]} over {HEALTHY[1]}: {contact_cost_ratio(costs):.3g}")


if __name__ == "__main__":
    main()
