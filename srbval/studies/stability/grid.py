"""The runs of the stability map, and their durations."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

from srbval.bearing import load_bearing
from srbval.errors import ConfigurationError
from srbval.models.solvers import SOLVERS
from srbval.scene import Scene
from srbval.studies.scenes import RIG_SHOWN, RPM, bench_scene, check_names

WHOLE_HZ = 256.0  # durations are multiples of 1/256 s, and so of every output interval in use


class StabilityGroup(NamedTuple):
    """What the cells of one part of the map have in common, the converged run among it."""

    scene: str
    rpm: float
    critical_velocity_m_s: float


class StabilityCase(NamedTuple):
    """One run of the map, or a converged one."""

    group: StabilityGroup
    solver: str
    steps_per_s: int


@dataclass(frozen=True, kw_only=True)
class StabilityGrid:
    """Every combination of these is a cell.

    `steps_per_s` are the step sizes as divisors of a second; `seconds` the least duration of a run, or `passages` of
    a roller over the outer race where these take longer; `settle_passages` precede it. Converged runs take
    `reference_steps_per_s`, and once more half as many.
    """

    scenes: tuple[str, ...]
    solvers: tuple[str, ...]
    steps_per_s: tuple[int, ...]
    rpm: tuple[float, ...]
    critical_velocity_m_s: tuple[float, ...]
    seconds: float
    passages: float
    settle_passages: float
    reference_steps_per_s: int

    def __post_init__(self) -> None:
        check_names(self.scenes, self.solvers)
        for steps in (*self.steps_per_s, self.reference_steps_per_s):
            if not 1000 <= steps <= 10**7:
                raise ConfigurationError(f"--steps-per-s {steps}: steps must lie between 1/1000 s and 1/10000000 s.")
        for rpm in self.rpm:
            if not 0 < rpm <= 20000:
                raise ConfigurationError(f"--rpm {rpm:g}: speeds of the map must lie between 0 and 20000 rpm.")

    @property
    def groups(self) -> list[StabilityGroup]:
        """Scene, speed and critical velocity: what shares a converged run."""
        every = itertools.product(self.scenes, self.critical_velocity_m_s, self.rpm)
        return [StabilityGroup(scene, rpm, velocity) for scene, velocity, rpm in every]

    @property
    def cases(self) -> Iterator[StabilityCase]:
        """Every cell of the map."""
        return itertools.starmap(StabilityCase, itertools.product(self.groups, self.solvers, self.steps_per_s))

    def scene(self, case: StabilityCase) -> Scene:
        """The scene that a case runs."""
        name, rpm, velocity = case.group
        scene = bench_scene(
            name, solver=case.solver, step_s=1 / case.steps_per_s, seconds=1.0, settle_s=0.0,
            contact={"critical_velocity_m_s": velocity},
        )  # fmt: skip
        passage_s = 1 / load_bearing(scene.bearing).orders.at(rpm / 60).bpfo_hz
        return replace(
            scene,
            shaft_speed_rad_s=rpm * RPM,
            duration_s=_whole(max(self.seconds, self.passages * passage_s)),
            settle_s=_whole(self.settle_passages * passage_s),
        )


def _whole(seconds: float) -> float:
    return math.ceil(seconds * WHOLE_HZ - 1e-9) / WHOLE_HZ


FULL = StabilityGrid(
    scenes=("play0-outer", "interference-outer"), solvers=SOLVERS,
    steps_per_s=(245760, 122880, 61440, 30720, 15360, 7680),
    rpm=(127.0, 355.0, 710.0, 1000.0, 1500.0, 3000.0, 6000.0), critical_velocity_m_s=(0.001, 0.5),
    seconds=0.5, passages=4.0, settle_passages=2.0, reference_steps_per_s=983040,
)  # fmt: skip
QUICK = replace(
    FULL, scenes=("play0-outer",), steps_per_s=(61440, 30720, 7680), rpm=(710.0, 3000.0), seconds=0.05,
    reference_steps_per_s=245760,
)  # fmt: skip
RIG = replace(  # its default step among them; oil has its own critical velocity: no run reads this one
    FULL,
    scenes=RIG_SHOWN,
    critical_velocity_m_s=(0.1,),
    steps_per_s=tuple(sorted({*FULL.steps_per_s, 40960}, reverse=True)),
)
