"""The scenes that solvers are compared on, with play and with the printed roller diameter; durations, repetitions."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
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


@dataclass(frozen=True, kw_only=True)
class BenchSettings:
    """Durations in simulated seconds, and how often things are repeated.

    `timing_s` of each timed run, after `timing_settle_s`; `accuracy_s` of each run that is compared with the reference,
    after `accuracy_settle_s`; `memory_s` of the run whose memory is read; `reference_budget_s` wall time that one
    reference may take; `window_s` of the trajectories compared point by point; `steps` step sizes of the work-precision
    study, as divisors of a second.
    """

    timing_s: float
    timing_settle_s: float
    repeats: int
    accuracy_s: float
    accuracy_settle_s: float
    memory_s: float
    starts: int
    reference_budget_s: float
    window_s: float
    steps: tuple[int, ...]


FULL = BenchSettings(
    timing_s=0.3, timing_settle_s=0.1, repeats=5, accuracy_s=4.0, accuracy_settle_s=0.25, memory_s=10.0, starts=3,
    reference_budget_s=60.0, window_s=0.02, steps=(30720, 61440, 122880, 245760),
)  # fmt: skip
QUICK = BenchSettings(
    timing_s=0.05, timing_settle_s=0.05, repeats=2, accuracy_s=0.5, accuracy_settle_s=0.1, memory_s=1.0, starts=1,
    reference_budget_s=10.0, window_s=0.005, steps=(61440, 122880),
)  # fmt: skip


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
    check_scenes([name])
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


def check_scenes(names: Sequence[str]) -> None:
    """Raise `ConfigurationError` for a name that is none of `SCENES`."""
    for name in names:
        if name not in SCENES + RIG_SCENES:
            raise ConfigurationError(f"scene {name!r} is not known to bench. Known: {', '.join(SCENES + RIG_SCENES)}.")


def check_solvers(names: Sequence[str]) -> None:
    """Raise `ConfigurationError` for a name that is no solver."""
    for name in names:
        if name not in SOLVERS:
            raise ConfigurationError(f"solver {name!r} is not known. Known: {', '.join(SOLVERS)}.")
