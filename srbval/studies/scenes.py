"""The scenes that solvers are compared on, with play and with the printed roller diameter."""

import math
from collections.abc import Sequence
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.errors import ConfigurationError
from srbval.models.solvers import SOLVERS
from srbval.scene import Scene, load_scene

PAPER_STEP_S = 1 / 61440  # Table 4
RPM = 2 * math.pi / 60  # rad/s
OUTPUT_RATE_HZ = 20480.0  # the rig's sampling rate, section 3.2
CONTACTS: dict[str, dict[str, Any]] = {"play0": {}, "interference": {"roller_fit": "printed"}}
STATES = (Fault.HEALTHY, *RACE_DEFECTS)
SCENES = tuple(f"{contact}-{state}" for contact in CONTACTS for state in STATES)
RIG_SCENES = tuple(f"rig-{state}" for state in STATES)  # on request
RIG_SHOWN = ("rig-outer",)  # in the report


def base_of(name: str) -> str:
    """The bundled scene that a scene of the bench begins with."""
    return "rig" if name.split("-")[0] == "rig" else "paper"


def bench_scene(
    name: str,
    *,
    solver: str,
    step_s: float = PAPER_STEP_S,
    seconds: float,
    settle_s: float,
    contact: dict[str, Any] | None = None,
) -> Scene:
    """The paper's scene with the roller fit and state in `name`, such as ``interference-outer``, or ``rig-outer``.

    `contact` is laid over its contact table. Raises `ConfigurationError` for an unknown name.
    """
    check_names([name], [])
    reading, state = name.split("-")
    changes = {
        "duration_s": seconds,
        "settle_s": settle_s,
        "output_rate_hz": output_rate_hz(step_s),
        "contact": CONTACTS.get(reading, {}) | (contact or {}),
        "defect": {"kind": state},
        "solver": {"name": solver, "step_s": step_s},
    }
    return load_scene(base_of(name), changes)


def output_rate_hz(step_s: float) -> float:
    """The rig's sampling rate where the step divides its interval; else the largest step rate at or below it."""
    per_output = 1 / (OUTPUT_RATE_HZ * step_s)
    if abs(per_output - round(per_output)) < 1e-6 * per_output and round(per_output) >= 1:
        return OUTPUT_RATE_HZ
    return 1 / (step_s * math.ceil(per_output))


def check_names(scenes: Sequence[str], solvers: Sequence[str]) -> None:
    """Raise `ConfigurationError` for a name that is none of `SCENES` or `RIG_SCENES`, or no solver."""
    for what, names, known in (("scene", scenes, SCENES + RIG_SCENES), ("solver", solvers, SOLVERS)):
        for name in names:
            if name not in known:
                raise ConfigurationError(f"{what} {name!r} is not known. Known: {', '.join(known)}.")
