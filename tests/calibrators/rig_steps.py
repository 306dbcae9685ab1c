"""Are the rig scene's default runs converged? ``python -m tests.calibrators.rig_steps``: the error of each over speed.

A run as `srbval simulate rig` makes it, with the step that it chooses, against one with 61 slices and steps of
1/163840 s. Prints the errors with their standard errors, and what the default run cost.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

from srbval.bearing import Fault
from srbval.models.simulate import Step, simulate
from srbval.models.step_error import differences, means_of
from srbval.scene import load_scene
from tests.calibrators.rows import print_rows

SPEEDS_RPM = (127.0, 340.0, 858.94, 2000.0, 3000.0)
STATES = (Fault.OUTER, Fault.HEALTHY)
SECONDS, SLICES, STEP_S = 2.0, 61, 1 / 163840


def compare(state: Fault, rpm: float, seconds: float) -> Iterator[tuple[str, Any]]:
    """Errors of the default run at one speed, by what they are of."""
    scene = load_scene("rig", {"defect": {"kind": state.scene_word}, "duration_s": seconds})
    scene = replace(scene, shaft_speed_rad_s=rpm * math.pi / 30)
    fine = replace(
        scene,
        line_contact=replace(scene.line_contact, slices=SLICES),
        solver=replace(scene.solver, step_s=STEP_S),
    )
    run, right = simulate(scene, step=Step.AUTO), simulate(fine, step=Step.UNCHECKED)
    yield from (("state", state.value), ("rpm", rpm), ("1/step [Hz]", round(1 / run.scene.solver.step_s)))
    yield from (("status", run.status.value), ("s per s", f"{run.wall_per_simulated_s:.2f}"))
    for error in differences(means_of(run), means_of(right)):
        yield error.of, f"{error.error:+.2g} ± {error.scatter:.1g}"
    yield from ((f"{band} Hz [m/s2]", f"{rms:.3g}") for band, rms in run.band_rms_m_s2.items())


def main(arguments: Sequence[str] | None = None) -> None:
    """Compare at every speed and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--rpm", type=float, nargs="+", default=SPEEDS_RPM)
    options = parser.parse_args(arguments)
    print_rows([dict(compare(state, rpm, options.seconds)) for state in STATES for rpm in options.rpm])


if __name__ == "__main__":
    main()
