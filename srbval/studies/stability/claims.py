"""Test of the paper's two claims about its time integration, by counting stable runs of the stability study.

A cell is a run of one scene, solver, speed and step. Only cells of the paper's scenes at the paper's step are counted.
The result of a claim contains its quotation, `borne_out` (None if the cells do not cover it), counts, and `answer`.
"""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from srbval.models.solvers import METHODS
from srbval.sweep.scenes import PAPER

Cells = Sequence[Mapping[str, Any]]
VERDICT = {True: "Borne out", False: "Not borne out", None: "Not covered"}


def claims(cells: Cells) -> list[dict[str, Any]]:
    """Test two claims of the paper by the runs `cells`: lowest order of a stable solver, highest stable shaft speed."""
    own = [
        cell for cell in cells
        if cell["model"] == "full" and math.isclose(cell["dt_s"], PAPER.step_s, rel_tol=1e-6)
    ]  # fmt: skip
    return [_lowest_order(own), _above_limit(own)]


def _lowest_order(cells: Cells) -> dict[str, Any]:
    """Test that the paper's solver is the lowest-order explicit solver that is stable up to the paper's speed limit."""
    slow = [cell for cell in cells if cell["rpm"] <= PAPER.limit_rpm]
    counts = {
        name: count([cell for cell in slow if cell["solver"] == name])
        for name, method in METHODS.items()
        if not method.implicit
    }
    stable = [name for name, (good, of) in counts.items() if of and good == of]
    covered = all(of for _, of in counts.values())
    borne_out = stable[:1] == [PAPER.solver] if covered else None
    found = (
        f"the lowest order that works in every cell is {stable[0]}"
        if stable
        else "no explicit method works in every cell"
    )
    by_method = ", ".join(f"{name} in {good} of {of}" for name, (good, of) in counts.items())
    text = f"up to {PAPER.limit_rpm:g} rpm at {_step()} {found} ({by_method})"
    return _claim("lowest order", PAPER.lowest_order, borne_out, text, stable=stable, counts=counts)


def _above_limit(cells: Cells) -> dict[str, Any]:
    """Test the paper's limit of shaft speed: no run fails up to this limit, and some run fails at each higher speed."""
    own = [cell for cell in cells if cell["solver"] == PAPER.solver]
    below, above = ([c for c in own if (c["rpm"] > PAPER.limit_rpm) is fast] for fast in (False, True))
    failing = sorted({cell["rpm"] for cell in above if not cell["stable"]})
    every = sorted({cell["rpm"] for cell in above})
    borne_out = failing == every and all(c["stable"] for c in below) if below and above else None
    (good, of), (fast_good, fast_of) = count(below), count(above)
    points = max((cell["points_per_step"] for cell in own), default=math.nan)
    text = (
        f"{PAPER.solver} at {_step()} works in {good} of {of} cells up to {PAPER.limit_rpm:g} rpm and in "
        f"{fast_good} of {fast_of} above; at most {points:.2f} points of the inner race pass a roller in a step"
    )
    return _claim("speed", PAPER.speed_limit, borne_out, text, below=(good, of), above=(fast_good, fast_of))


def count(cells: Cells) -> tuple[int, int]:
    """Number of stable runs, and of all runs, in `cells`."""
    return sum(bool(cell["stable"]) for cell in cells), len(cells)


def _step() -> str:
    return f"1/{1 / PAPER.step_s:.0f} s"


def _claim(kind: str, quotation: str, borne_out: bool | None, text: str, **counted: Any) -> dict[str, Any]:
    answer = f"{VERDICT[borne_out]}: “{quotation}”" + (f": {text}." if borne_out is not None else ".")
    return {"kind": kind, "claim": quotation, "borne_out": borne_out, "answer": answer, **counted}
