"""A run of a rung with the full model's equations: from static balance, advanced interval by interval."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters, geometry_of
from srbval.models.full.steps import take_steps
from srbval.models.ladder import check_known, rung_of
from srbval.models.outputs import Outputs
from srbval.models.solvers import METHODS, Method
from srbval.scene import Scene


@dataclass(frozen=True, kw_only=True, eq=False)
class FullRun:
    """Where a run stands: `state` and the method's `memory` of the step before, both changed in place by `advance`."""

    model: Parameters
    method: Method
    state: FloatArray
    memory: FloatArray
    output_rate_hz: float
    steps_per_output: int

    @property
    def step_s(self) -> float:
        """The solver's step [s]."""
        return 1 / (self.output_rate_hz * self.steps_per_output)

    def advance(self, first: int, intervals: int, per_detail: int = 0) -> Outputs:
        """Run so many output intervals, of which `first` lie before; see `take_steps`."""
        return take_steps(
            self.model, self.state, self.method, step_s=self.step_s, intervals=intervals,
            steps_per_output=self.steps_per_output, first_interval=first, intervals_per_detail=per_detail,
            memory=self.memory,
        )  # fmt: skip

    def with_finer_steps(self, times: int) -> FullRun:
        """The same run from where it stands, with so many steps in one; this one is not changed by it."""
        return replace(
            self,
            state=self.state.copy(),
            memory=self.memory / times,  # a change of velocities over part of a step
            steps_per_output=self.steps_per_output * times,
        )


def full_run(scene: Scene, bearing: Bearing) -> FullRun:
    """The scene's run at its start, with its model and solver; `ConfigurationError` where there is no such thing."""
    check_known("solver", scene.solver.name, tuple(METHODS))
    rung = rung_of(scene.model)
    model = rung.make_parameters(scene, geometry_of(bearing))
    state = equilibrium_state(model).state
    return FullRun(
        model=model,
        method=METHODS[scene.solver.name],
        state=state,
        memory=np.zeros_like(state),
        output_rate_hz=scene.output_rate_hz,
        steps_per_output=rung.steps_per_output(scene),
    )
