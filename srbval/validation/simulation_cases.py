"""The runs that the report needs of its own: the paper's three and one variation at a time, run side by side.

A variation changes one thing that the paper leaves open or that the numerics decide; its effect on the cage speed, and
so on the race lines, is the uncertainty that this thing leaves.
"""

import os
from collections.abc import Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, NumericsError
from srbval.models.precompile import load_kernels
from srbval.models.run import Run
from srbval.models.simulate import simulate
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene
from srbval.validation.comparison import deviation_pct
from srbval.validation.effects import Effect, Sensitivity

PAPER_STATES = (Fault.HEALTHY, Fault.OUTER, Fault.INNER)
VARIATION_SECONDS = 4.0  # the mean cage speed of so long a run repeats to about 1e-5
STEP_FACTOR = 2
SMOOTH_FRICTION = "0.5 m/s"  # far above every sliding speed in the contacts: no sticking at all


@dataclass(frozen=True, kw_only=True)
class SimulationCase:
    """One run: its id, what it is for, the state it simulates, its scene and the bundled one that this changes."""

    id: str
    purpose: str
    state: Fault
    scene: Scene
    base: str = "paper"


@dataclass(frozen=True, kw_only=True)
class Variation:
    """A varied run against the paper's: cage ratios and what the change does to each race line [%].

    Both follow from the mean cage speed: BPFO = Z f_c, BPFI = Z (f_r - f_c).
    """

    id: str
    purpose: str
    state: str
    cage_ratio: float
    bpfo_hz: float
    bpfi_hz: float
    bpfo_change_pct: float
    bpfi_change_pct: float
    roller_load_share: float


class RunCancelled(Exception):
    """Raised inside a run when another one failed or the user interrupted."""


def paper_cases(seconds: float) -> list[SimulationCase]:
    """H, OR and IR at 710 rpm and 124.8 kN, `seconds` long."""
    return [_case(f"paper-{state}", "the paper's scene", state, seconds) for state in PAPER_STATES]


def variation_cases(seconds: float) -> list[SimulationCase]:
    """Half the step, the printed roller diameter, friction without sticking: outer race; the diameter on both."""
    duration = min(seconds, VARIATION_SECONDS)
    step = paper_scene().solver.step_s / STEP_FACTOR
    smooth, printed = {"critical_velocity": SMOOTH_FRICTION}, {"roller_fit": "printed"}
    friction = f"input: critical velocity {SMOOTH_FRICTION} instead of 1 mm/s"
    fit = "input: roller diameter as printed, 40.1 mm"
    return [
        _case("half-step", "numerics: half the step", Fault.OUTER, duration, solver={"step_s": step}),
        _case("smooth-friction", friction, Fault.OUTER, duration, contact=smooth),
        _case("interference-outer", fit, Fault.OUTER, duration, contact=printed),
        _case("interference-inner", fit, Fault.INNER, duration, contact=printed),
    ]


def _case(name: str, purpose: str, state: Fault, seconds: float, **changes: Any) -> SimulationCase:
    scene = paper_scene(duration_s=seconds, defect={"kind": state}, **changes)
    return SimulationCase(id=name, purpose=purpose, state=state, scene=scene)


def run_cases(
    cases: Sequence[SimulationCase], *, jobs: int | None = None, progress: Progress = silent
) -> dict[str, Run]:
    """Run all `cases`, `jobs` at a time (default: one per core), the longest first; runs by the cases' ids.

    Threads, since the kernels release the interpreter lock. `progress` gets one task per case. Raises `NumericsError`
    naming the first failed case; the others are stopped.
    """
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"jobs = {jobs} must be 1 or more.")
    cancelled = False

    def one(case: SimulationCase) -> Run:
        def report(_: str, fraction: float | None) -> None:
            if cancelled:
                raise RunCancelled
            progress(f"Simulate {case.id}", fraction)

        run = simulate(case.scene, progress=report)
        if not run.status.usable:
            raise NumericsError(f"case {case.id}: run failed ({run.status}): {run.reason}.")
        return run

    load_kernels(case.scene.model for case in cases)
    ordered = sorted(cases, key=lambda case: -case.scene.duration_s / case.scene.solver.step_s)
    with ThreadPoolExecutor(max_workers=jobs or os.cpu_count() or 1) as pool:
        futures = {case.id: pool.submit(one, case) for case in ordered}
        try:
            return {case.id: futures[case.id].result() for case in cases}
        except BaseException:
            cancelled = True
            pool.shutdown(wait=True, cancel_futures=True)
            raise


def variation(case: SimulationCase, run: Run, base: Run) -> Variation:
    """Compare a varied run with the run it was varied from."""
    return Variation(
        id=case.id,
        purpose=case.purpose,
        state=case.state.value,
        cage_ratio=run.cage_ratio,
        bpfo_hz=run.bpfo_hz,
        bpfi_hz=run.bpfi_hz,
        bpfo_change_pct=deviation_pct(run.bpfo_hz, base.bpfo_hz),
        bpfi_change_pct=deviation_pct(run.bpfi_hz, base.bpfi_hz),
        roller_load_share=run.roller_load_share,
    )


def as_sensitivity(variations: Iterable[Variation], base: Run) -> Sensitivity:
    """The effects of the outer-race run's variations on both race lines, where no study of all terms is stored."""
    effects, shaft_hz = [], base.scene.shaft_hz
    for varied in variations:
        kind, _, term = varied.purpose.partition(": ")
        changes = (
            (Fault.OUTER, base.bpfo_hz, varied.bpfo_change_pct),
            (Fault.INNER, base.bpfi_hz, varied.bpfi_change_pct),
        )
        for fault, base_hz, pct in changes if varied.state == Fault.OUTER.value else ():
            effects.append(
                Effect(
                    term=term, kind=kind, source="the report's own runs", defect=fault.value,
                    quantity=fault.line or "", unit="order", base=base_hz / shaft_hz,
                    bound=abs(pct) / 100 * base_hz / shaft_hz,
                )
            )  # fmt: skip
    return Sensitivity(effects=tuple(effects))
