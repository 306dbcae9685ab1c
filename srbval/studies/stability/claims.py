"""The paper's two claims about its time integration, tested by counting cells of the map."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from srbval.models.solvers import METHODS
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.stability.cell import StabilityCell

CLAIMED_LIMIT_RPM = 1000.0  # section 2.3: not simulated above
PAPER_SOLVER = "ode4"
Cells = Sequence[StabilityCell]


@dataclass(frozen=True, kw_only=True)
class Claim:
    """What the paper says, whether the cells confirm it (None: they do not cover it), and the counts behind that."""

    claim: str
    borne_out: bool | None
    answer: str
    evidence: tuple[str, ...]


def claims(cells: Cells) -> tuple[Claim, ...]:
    """Both claims, of what `cells` cover."""
    return _lowest_order(cells), _above_limit(cells)


def _lowest_order(cells: Cells) -> Claim:
    explicit = [solver for solver in _solvers(cells) if not METHODS[solver].implicit]
    at_step = {s: [c for c in _at_paper_step(cells, s) if _rpm(c) <= CLAIMED_LIMIT_RPM] for s in explicit}
    stable = [solver for solver in explicit if at_step[solver] and _all_stable(at_step[solver])]
    covered = PAPER_SOLVER in explicit and len(explicit) > 1 and all(at_step.values())
    where = f"at 1/{_per_s(PAPER_STEP_S)} s up to {CLAIMED_LIMIT_RPM:g} rpm"
    answer = f"No explicit method is stable in every cell {where}."
    if stable:
        yes_no = "Yes" if stable[0] == PAPER_SOLVER else "No"
        answer = f"{yes_no}: the lowest order that is stable in every cell {where} is {stable[0]}."
    return Claim(
        claim="ODE4 is the lowest order of solver that computes the model stably (section 2.3).",
        borne_out=stable[:1] == [PAPER_SOLVER] if covered else None,
        answer=answer if covered else "The cells of this map do not cover the claim.",
        evidence=tuple(_order_line([c for c in cells if _solver(c) == s], at_step[s]) for s in explicit),
    )


def _order_line(cells: Cells, at_step: Cells) -> str:
    """How an explicit method fares at the paper's step, and how long its step may be anywhere in the map."""
    text = f"{_solver(cells[0])}: {_count(at_step)} are stable there, {sum(c.ok for c in at_step)} within tolerance"
    if not _all_stable(at_step):
        text += f" ({_statuses(at_step)})"
    steps = sorted({c.case.steps_per_s for c in cells}, reverse=True)
    stable = [n for n in steps if all(c.stable for c in cells if c.case.steps_per_s >= n)]
    text += f"; over the whole map it is stable to 1/{stable[-1]} s" if stable else "; at no step over the whole map"
    elastic = [limit for c in cells if (limit := c.limits.elastic_s) is not None]
    whole = [limit for c in cells if (limit := c.limits.whole_s) is not None]
    if elastic and whole:
        text += (
            f"; linear theory: 1/{_per_s(min(elastic))} s without friction, with it 1/{_per_s(min(whole))} s, beyond "
            "which it chatters, bounded"
        )
    return text + "."


def _above_limit(cells: Cells) -> Claim:
    own = _at_paper_step(cells, PAPER_SOLVER)
    below, above = _split(own)
    covered = bool(below and above)
    failing = [rpm for rpm in sorted({_rpm(c) for c in above}) if not _all_stable(c for c in above if _rpm(c) == rpm)]
    everywhere = {_rpm(c) for c in above} == set(failing)
    borne_out = _all_stable(below) and everywhere if covered else None
    where = f"{PAPER_SOLVER} at 1/{_per_s(PAPER_STEP_S)} s is stable"
    answer = "The cells of this map do not cover the claim."
    if covered:
        partly = f"Only at {', '.join(f'{rpm:g}' for rpm in failing)} rpm" if failing and not everywhere else "No"
        answer = f"{'Yes' if borne_out else partly}: {where} in {_count(above)} above {CLAIMED_LIMIT_RPM:g} rpm and in "
        answer += f"{_count(below)} up to it. {_noisiest(own)} {_what_fails(cells)}"
    return Claim(
        claim=f"Above {CLAIMED_LIMIT_RPM:g} rpm the model's output becomes incorrect, as the points move too far in a "
        "time step (section 2.3).",
        borne_out=borne_out,
        answer=answer,
        evidence=(
            *_points_lines(own),
            *_noise_lines(own),
            *(_speed_line(_at_paper_step(cells, s), s) for s in _solvers(cells)),
        ),
    )


def _noisiest(own: Cells) -> str:
    """At which speed the chatter of explicit friction is worst, and what it is at the highest speed of that scene."""
    worst = max((c for c in own if math.isfinite(c.band_rms_part)), key=lambda c: c.band_rms_part)
    same = [c for c in own if c.case.group.scene == worst.case.group.scene]
    friction = worst.case.group.critical_velocity_m_s
    fastest = max((c for c in same if c.case.group.critical_velocity_m_s == friction), key=_rpm)
    return (
        f"Its vibration is furthest off at {_rpm(worst):g} rpm, {worst.band_rms_part:.2g} times the converged run's, "
        f"against {fastest.band_rms_part:.2g} at {_rpm(fastest):g} rpm ({worst.case.group.scene}, critical velocity "
        f"{friction:g} m/s)."
    )


def _what_fails(cells: Cells) -> str:
    """Methods and steps that are stable at every speed up to the limit, and not above."""
    lost = []
    for solver in _solvers(cells):
        for steps in sorted({c.case.steps_per_s for c in cells}, reverse=True):
            below, above = _split([c for c in cells if (_solver(c), c.case.steps_per_s) == (solver, steps)])
            if below and above and _all_stable(below) and not _all_stable(above):
                lost.append(f"{solver} at 1/{steps} s ({_statuses(above)})")
    if not lost:
        return "No method fails above that speed at a step at which it is stable below: steps fail, speeds do not."
    return f"What is stable up to that speed and fails above: {'; '.join(lost)}."


def _points_lines(own: Cells) -> list[str]:
    """How far the points of the inner race move past a roller in a step, at the highest speed."""
    if not own:
        return []
    fastest = max(own, key=_rpm)
    return [
        f"At {_rpm(fastest):g} rpm {fastest.points_per_step:.2f} points of the inner race pass a roller in a step of "
        f"1/{fastest.case.steps_per_s} s: {'still less than one' if fastest.points_per_step < 1 else 'one or more'}."
    ]


def _noise_lines(own: Cells) -> list[str]:
    """The chatter of explicit friction against speed, scene by scene, at the steepest friction."""
    lines = []
    for scene in dict.fromkeys(c.case.group.scene for c in own):
        cells = [c for c in own if c.case.group.scene == scene]
        steepest = min(c.case.group.critical_velocity_m_s for c in cells)
        shown = [c for c in cells if c.case.group.critical_velocity_m_s == steepest]
        speeds = "; ".join(
            f"{_rpm(c):g} rpm {c.band_rms_part:.2g} times, {abs(c.outcome.energy_imbalance):.0%}" for c in shown
        )
        lines.append(
            f"{_solver(own[0])} at 1/{own[0].case.steps_per_s} s, {scene}, critical velocity {steepest:g} m/s: 500-"
            f"1500 Hz RMS over the converged run's, and losses without a source, by speed: {speeds}."
        )
    return lines


def _speed_line(cells: Cells, solver: str) -> str:
    """A method at the paper's step on either side of the speed."""
    parts = []
    for part, name in zip(_split(cells), ("up to", "above"), strict=True):
        if part:
            text = f"{_count(part)} are stable {name} {CLAIMED_LIMIT_RPM:g} rpm"
            held = [c.cage_error for c in part if c.stable]
            text += f", cage within {max(held):.1g} of the converged run" if held else ""
            noise = [c.band_rms_part for c in part if c.stable]
            text += f", 500-1500 Hz RMS {min(noise):.2g} to {max(noise):.2g} times its" if held else ""
            parts.append(text if _all_stable(part) else f"{text} ({_statuses(part)})")
    return f"{solver} at 1/{_per_s(PAPER_STEP_S)} s: {'; '.join(parts) or 'not in this map'}."


def _split(cells: Cells) -> tuple[Cells, Cells]:
    limit = CLAIMED_LIMIT_RPM
    return [c for c in cells if _rpm(c) <= limit], [c for c in cells if _rpm(c) > limit]


def _at_paper_step(cells: Cells, solver: str) -> Cells:
    return [c for c in cells if _solver(c) == solver and math.isclose(c.case.step_s, PAPER_STEP_S, rel_tol=1e-6)]


def _statuses(cells: Cells) -> str:
    """The ways in which those that are not stable fail, and at which speeds."""
    failed = [c for c in cells if not c.stable]
    words = []
    for status in sorted({c.status for c in failed}):
        speeds = sorted({_rpm(c) for c in failed if c.status == status})
        words.append(f"{status} at {', '.join(f'{rpm:g}' for rpm in speeds)} rpm")
    return "; ".join(words)


def _count(cells: Cells) -> str:
    return f"{sum(c.stable for c in cells)} of {len(cells)} cells"


def _all_stable(cells: Iterable[StabilityCell]) -> bool:
    return all(c.stable for c in cells)


def _solvers(cells: Cells) -> list[str]:
    return [name for name in METHODS if any(_solver(c) == name for c in cells)]


def _solver(cell: StabilityCell) -> str:
    return cell.case.solver


def _rpm(cell: StabilityCell) -> float:
    return cell.case.group.rpm


def _per_s(step_s: float) -> str:
    return f"{1 / step_s:.0f}" if 1 / step_s < 1e6 else f"{1 / step_s:.3g}"
