"""The paper's two claims about its time integration, tested by counting cells of the map.

A claim says what the paper does, whether the cells confirm it (`borne_out`, None: they do not cover it), and in words.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from srbval.models.solvers import METHODS
from srbval.studies.scenes import PAPER_STEP_S

CLAIMED_LIMIT_RPM = 1000.0  # section 2.3: not simulated above
PAPER_SOLVER = "ode4"
AT_STEP = f"at 1/{1 / PAPER_STEP_S:.0f} s"
NOT_COVERED = "The cells of this map do not cover the claim."
Cells = Sequence[Mapping[str, Any]]


def claims(cells: Cells) -> list[dict[str, Any]]:
    """Both claims, of what `cells` cover."""
    return [_lowest_order(cells), _above_limit(cells)]


def _lowest_order(cells: Cells) -> dict[str, Any]:
    explicit = [solver for solver in _solvers(cells) if not METHODS[solver].implicit]
    at_step = {s: _split(_at_paper_step(cells, s))[0] for s in explicit}
    stable = [solver for solver in explicit if at_step[solver] and _all_stable(at_step[solver])]
    covered = PAPER_SOLVER in explicit and len(explicit) > 1 and all(at_step.values())
    where = f"{AT_STEP} up to {CLAIMED_LIMIT_RPM:g} rpm"
    answer = f"No explicit method is stable in every cell {where}."
    if stable:
        yes_no = "Yes" if stable[0] == PAPER_SOLVER else "No"
        answer = f"{yes_no}: the lowest order that is stable in every cell {where} is {stable[0]}."
    return {
        "claim": "ODE4 is the lowest order of solver that computes the model stably (section 2.3).",
        "borne_out": stable[:1] == [PAPER_SOLVER] if covered else None,
        "answer": answer if covered else NOT_COVERED,
    }


def _above_limit(cells: Cells) -> dict[str, Any]:
    own = _at_paper_step(cells, PAPER_SOLVER)
    below, above = _split(own)
    speeds = sorted({c["rpm"] for c in above})
    failing = [rpm for rpm in speeds if not _all_stable(c for c in above if c["rpm"] == rpm)]
    answer, borne_out = NOT_COVERED, None
    if below and above:
        borne_out = _all_stable(below) and speeds == failing
        partly = f"Only at {', '.join(f'{rpm:g}' for rpm in failing)} rpm" if failing and speeds != failing else "No"
        answer = (
            f"{'Yes' if borne_out else partly}: {PAPER_SOLVER} {AT_STEP} is stable in {_count(above)} above "
            f"{CLAIMED_LIMIT_RPM:g} rpm and in {_count(below)} up to it. {_noisiest(own)} {_what_fails(cells)}"
        )
    return {
        "claim": f"Above {CLAIMED_LIMIT_RPM:g} rpm the model's output becomes incorrect, as the points move too far in "
        "a time step (section 2.3).",
        "borne_out": borne_out,
        "answer": answer,
    }


def _noisiest(own: Cells) -> str:
    """At which speed the chatter of explicit friction is worst, and what it is at the highest speed of that scene."""
    worst = max((c for c in own if math.isfinite(c["band_rms_part"])), key=lambda c: float(c["band_rms_part"]))
    alike = [c for c in own if all(c[name] == worst[name] for name in ("scene", "critical_velocity_m_s"))]
    fastest, points = max(alike, key=lambda c: float(c["rpm"])), max(c["points_per_step"] for c in own)
    return (
        f"Its vibration is furthest off at {worst['rpm']:g} rpm, {worst['band_rms_part']:.2g} times the converged "
        f"run's, against {fastest['band_rms_part']:.2g} at {fastest['rpm']:g} rpm ({worst['scene']}, critical velocity "
        f"{worst['critical_velocity_m_s']:g} m/s). At most {points:.2f} points of the inner race pass in a step."
    )


def _what_fails(cells: Cells) -> str:
    """Methods and steps that are stable at every speed up to the limit, and not above."""
    lost = []
    for solver in _solvers(cells):
        for steps in sorted({_steps(c) for c in cells}, reverse=True):
            below, above = _split([c for c in cells if (c["solver"], _steps(c)) == (solver, steps)])
            if below and above and _all_stable(below) and not _all_stable(above):
                lost.append(f"{solver} at 1/{steps} s ({_statuses(above)})")
    if not lost:
        return "No method fails above that speed at a step at which it is stable below: steps fail, speeds do not."
    return f"What is stable up to that speed and fails above: {'; '.join(lost)}."


def _split(cells: Cells) -> tuple[Cells, Cells]:
    limit = CLAIMED_LIMIT_RPM
    return [c for c in cells if c["rpm"] <= limit], [c for c in cells if c["rpm"] > limit]


def _at_paper_step(cells: Cells, solver: str) -> Cells:
    step_s = PAPER_STEP_S
    return [c for c in cells if c["solver"] == solver and math.isclose(c["dt_s"], step_s, rel_tol=1e-6)]


def _count(cells: Cells) -> str:
    return f"{sum(c['stable'] for c in cells)} of {len(cells)} cells"


def _statuses(cells: Cells) -> str:
    """The ways in which those that are not stable fail, and at which speeds."""
    failed = [c for c in cells if not c["stable"]]
    words = []
    for status in sorted({c["status"] for c in failed}):
        speeds = sorted({c["rpm"] for c in failed if c["status"] == status})
        words.append(f"{status} at {', '.join(f'{rpm:g}' for rpm in speeds)} rpm")
    return "; ".join(words)


def _all_stable(cells: Iterable[Mapping[str, Any]]) -> bool:
    return all(c["stable"] for c in cells)


def _solvers(cells: Cells) -> list[str]:
    return [name for name in METHODS if any(c["solver"] == name for c in cells)]


def _steps(cell: Mapping[str, Any]) -> int:
    return round(1 / cell["dt_s"])
