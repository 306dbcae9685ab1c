"""Named scenes on which solvers are compared, and the integration settings of the paper."""

import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.models.hierarchy import check_known
from srbval.models.solvers import SOLVERS
from srbval.scene import Scene, load_scene
from srbval.storage.tables import read_toml

OUTPUT_RATE_HZ = 20480.0  # sampling rate of the rig, section 3.2
DURATION_GRID_HZ = 256.0  # durations are multiples of 1/256 s, which contains whole output intervals
FITS: dict[str, dict[str, Any]] = {"play0": {}, "interference": {"roller_fit": "printed"}, "rig": {}}
SOLVER_SCENES = tuple(f"{fit}-{state}" for fit in FITS for state in (Fault.HEALTHY, *RACE_DEFECTS))
# Solver, step, cost and limits stated in the paper; `simulated_s` of time need `wall_s` of computing.
PAPER = SimpleNamespace(**read_toml(Path(__file__).with_name("paper_integration.toml")))


def base_of(name: str) -> str:
    """Name of the bundled scene, ``paper`` or ``rig``, from which the scene `name` is made."""
    return "rig" if name.split("-")[0] == "rig" else "paper"


def bench_scene(
    name: str, *, solver: str, step_s: float, seconds: float = 1.0, settle_s: float = 0.0, rpm: float | None = None
) -> Scene:
    """Create the scene `name`, at its own speed or at `rpm`; `seconds` are recorded after `settle_s` seconds.

    `name` is a word, a hyphen and the bearing state, as in ``interference-outer``. The word is ``rig``, or for the
    paper's scene ``play0`` (rollers without play) or ``interference`` (rollers of the printed diameter, 40.1 mm, which
    exceeds the gap between the races). Raises `ConfigurationError` for an unknown name.
    """
    check_names([name], [solver])
    fit, state = name.split("-")
    parts = {"contact": FITS[fit], "defect": {"kind": state}, "solver": {"name": solver, "step_s": step_s}}
    times = {"duration_s": seconds, "settle_s": settle_s, "output_rate_hz": output_rate_hz(step_s)}
    speed = {} if rpm is None else {"shaft_speed_rad_s": rpm * 2 * math.pi / 60}
    return load_scene(base_of(name), parts | times | speed)


def lasting_passages(scene: Scene, passages: float, *, least_s: float, settle: float) -> Scene:
    """Copy a scene with its times in roller passages, 1 / BPFO each: settling time `settle`, duration `passages`.

    The duration is at least `least_s` seconds.
    """
    passage_s = 1 / load_bearing(scene.bearing).orders.at(scene.shaft_hz).bpfo_hz
    wanted_s = max(least_s, passages * passage_s), settle * passage_s
    seconds, settle_s = (math.ceil(s * DURATION_GRID_HZ - 1e-9) / DURATION_GRID_HZ for s in wanted_s)
    return replace(scene, duration_s=seconds, settle_s=settle_s)


def output_rate_hz(step_s: float) -> float:
    """Output rate [Hz]: the rig's sampling rate, or the next lower rate whose interval is a whole number of steps."""
    per_output = 1 / (OUTPUT_RATE_HZ * step_s)
    if abs(per_output - round(per_output)) < 1e-6 * per_output and round(per_output) >= 1:
        return OUTPUT_RATE_HZ
    return 1 / (step_s * math.ceil(per_output))


def check_names(scenes: Iterable[str], solvers: Iterable[str]) -> None:
    """Raise `ConfigurationError` if a name is not a scene for comparing solvers, or not a solver."""
    for what, names, known in (("scene", scenes, SOLVER_SCENES), ("solver", solvers, SOLVERS)):
        for name in names:
            check_known(what, name, known)
