"""The runs a report needs of itself: the paper's three, and one variation at a time.

A variation changes one thing that the paper leaves open or that the numerics decide, on the outer-race scene; its
effect on the cage speed is the uncertainty that this thing leaves.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from srbval.bearing import Fault
from srbval.scene import Scene, paper_scene

PAPER_STATES = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
VARIATION_SECONDS = 4.0  # the mean cage speed of so long a run repeats to about 1e-5
STEP_FACTOR = 2
SMOOTH_FRICTION = "0.5 m/s"  # far above every sliding speed in the contacts: no sticking at all


@dataclass(frozen=True, kw_only=True)
class Case:
    """One run: its id, what it is for, the state it simulates, its scene."""

    id: str
    purpose: str
    state: Fault
    scene: Scene


def paper_cases(seconds: float) -> list[Case]:
    """H, OR and IR at 710 rpm and 124.8 kN, `seconds` long."""
    return [
        Case(
            id=f"paper-{state}",
            purpose="the paper's scene",
            state=state,
            scene=paper_scene(duration_s=seconds, defect={"kind": state}),
        )
        for state in PAPER_STATES
    ]


def variation_cases(seconds: float) -> list[Case]:
    """Half the step, the printed roller diameter, friction without sticking: outer race; the diameter on both."""
    duration = min(seconds, VARIATION_SECONDS)
    step = paper_scene().solver.step_s / STEP_FACTOR
    return [
        _variation("half-step", "numerics: half the step", Fault.OUTER, duration, solver={"step_s": step}),
        _variation("smooth-friction", f"input: critical velocity {SMOOTH_FRICTION} instead of 1 mm/s", Fault.OUTER,
                   duration, contact={"critical_velocity": SMOOTH_FRICTION}),
        _variation("interference-outer", "input: roller diameter as printed, 40.1 mm", Fault.OUTER,
                   duration, contact={"roller_fit": "printed"}),
        _variation("interference-inner", "input: roller diameter as printed, 40.1 mm", Fault.INNER,
                   duration, contact={"roller_fit": "printed"}),
    ]  # fmt: skip


def _variation(name: str, purpose: str, state: Fault, seconds: float, **changes: Any) -> Case:
    scene = paper_scene(duration_s=seconds, defect={"kind": state}, **changes)
    return Case(id=name, purpose=purpose, state=state, scene=scene)
