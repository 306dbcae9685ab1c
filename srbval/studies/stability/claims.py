"""The paper's two claims about its time integration, tested by counting cells of the map.

A row has the claim, whether the cells confirm it (`borne_out`, None: they do not cover it), and what was counted.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from srbval.models.solvers import METHODS
from srbval.studies.scenes import PAPER_STEP_S

CLAIMED_LIMIT_RPM = 1000.0  # section 2.3: not simulated above
PAPER_SOLVER = "ode4"
Cells = Sequence[Mapping[str, Any]]


def claims(cells: Cells) -> list[dict[str, Any]]:
    """Both claims, of what `cells` cover."""
    return [one | {"limit_rpm": CLAIMED_LIMIT_RPM} for one in (_lowest_order(cells), _above_limit(cells))]


def _lowest_order(cells: Cells) -> dict[str, Any]:
    """`stable`: the explicit methods that are stable in every cell at the paper's step up to the claimed speed."""
    solvers = {cell["solver"] for cell in cells}
    explicit = [name for name, method in METHODS.items() if name in solvers and not method.implicit]
    at_step = {solver: _split(_at_paper_step(cells, solver))[0] for solver in explicit}
    stable = [solver for solver in explicit if at_step[solver] and _all_stable(at_step[solver])]
    covered = PAPER_SOLVER in explicit and len(explicit) > 1 and all(at_step.values())
    return {
        "claim": "ODE4 is the lowest order of solver that computes the model stably (section 2.3).",
        "borne_out": stable[:1] == [PAPER_SOLVER] if covered else None, "kind": "lowest order", "stable": stable,
    }  # fmt: skip


def _above_limit(cells: Cells) -> dict[str, Any]:
    """`above`, `below`: stable cells of the paper's method at its step, of how many, above the claimed speed or not.

    `failing_rpm`: speeds above it with a cell that is not stable. `points_per_step`: the most that pass.
    """
    own = _at_paper_step(cells, PAPER_SOLVER)
    below, above = _split(own)
    speeds = sorted({c["rpm"] for c in above})
    failing = [rpm for rpm in speeds if not _all_stable(c for c in above if c["rpm"] == rpm)]
    return {
        "claim": f"Above {CLAIMED_LIMIT_RPM:g} rpm the model's output becomes incorrect, as the points move too far in "
        "a time step (section 2.3).",
        "borne_out": _all_stable(below) and speeds == failing if below and above else None, "kind": "speed",
        **{name: (sum(c["stable"] for c in of), len(of)) for name, of in (("above", above), ("below", below))},
        "failing_rpm": failing, "points_per_step": max((c["points_per_step"] for c in own), default=math.nan),
    }  # fmt: skip


def _split(cells: Cells) -> tuple[Cells, Cells]:
    limit = CLAIMED_LIMIT_RPM
    return [c for c in cells if c["rpm"] <= limit], [c for c in cells if c["rpm"] > limit]


def _at_paper_step(cells: Cells, solver: str) -> Cells:
    step_s = PAPER_STEP_S
    return [c for c in cells if c["solver"] == solver and math.isclose(c["dt_s"], step_s, rel_tol=1e-6)]


def _all_stable(cells: Iterable[Mapping[str, Any]]) -> bool:
    return all(c["stable"] for c in cells)
