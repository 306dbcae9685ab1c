"""Run of a model with the full model's equations, from static balance, one output interval after another."""

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as out_col
from srbval.models.full import columns as col
from srbval.models.full.columns import layout_of
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.forces_kernel import CIRCLES_PER_RACE
from srbval.models.full.parameters import Parameters
from srbval.models.full.rates import rates
from srbval.models.full.step_kernel import ADVANCE, working_space
from srbval.models.health import default_solver
from srbval.models.hierarchy import geometry_of, level_of
from srbval.models.outputs import Outputs, split_run
from srbval.models.run_statistics import RingSupport, RunStatistics, load_share
from srbval.models.solvers import METHODS, Method
from srbval.models.step_limits import elastic_limit_s
from srbval.scene import Scene


@dataclass(frozen=True, eq=False)
class FullRun:
    """Run in progress at its `state`.

    `memory`, of the state's shape: change of speeds that imex1 and imex2 predict for their next step, zeros at the
    start. `advance` updates both in place.
    """

    model: Parameters
    method: Method
    state: FloatArray
    memory: FloatArray
    output_rate_hz: float
    steps_per_output: int

    @property
    def step_s(self) -> float:
        """Solver step [s]."""
        return 1 / (self.output_rate_hz * self.steps_per_output)

    def advance(self, first: int, intervals: int, per_detail: int = 0) -> Outputs:
        """Integrate `intervals` output intervals, beginning with the interval number `first` of the run.

        If there are none, the kernel is only compiled. `per_detail`: number of intervals from one output of spins and
        contact loads of the rollers to the next, 0 for none.
        """
        state, steps, step_s, rollers = self.state, self.steps_per_output, self.step_s, len(self.model.slot_angle)
        starts = range(first, first + intervals, per_detail or max(intervals, 1))
        details = len(starts) if per_detail else 0
        out, spins = np.zeros((intervals, out_col.COLUMN_COUNT)), np.zeros((details, rollers))
        loads = np.zeros((details, 2, rollers, CIRCLES_PER_RACE))
        work = working_space(self.memory, len(self.method.b))
        model = self.model._replace(law=self.model.law._replace(onset_s=self.method.onset * step_s))
        for number, start in enumerate(starts or (first,)):
            rows = out[start - first :][: starts.step]
            if number < details:
                spins[number] = state[layout_of(state).spin]
                loads[number] = rates(model, start * steps * step_s, state).load_n
            ADVANCE[self.method.family](state, start * steps, step_s, steps, self.method, model, work, rows)
        return Outputs(out=out, spin_rad_s=spins, load_n=loads)

    def with_finer_steps(self, times: int) -> "FullRun":
        """Copy the run at its present state, with each solver step divided into `times` steps."""
        return replace(
            self,
            state=self.state.copy(),
            memory=self.memory / times,  # a change of velocities over part of a step
            steps_per_output=self.steps_per_output * times,
        )

    def with_output_rate(self, least_hz: float) -> "FullRun":
        """Return the run with an output rate of `least_hz` or more (at most one output per step) and the same step."""
        steps, step_s = self.steps_per_output, self.step_s
        fitting = (n for n in range(1, steps + 1) if steps % n == 0 and n * least_hz * step_s <= 1)
        per_output = max(fitting, default=1)
        rate_hz = self.output_rate_hz * (steps // per_output)
        return replace(self, output_rate_hz=rate_hz, steps_per_output=per_output)


def start_full_run(scene: Scene, bearing: Bearing) -> FullRun:
    """Prepare a run in static balance; raises `ConfigurationError` for a scene that the model cannot simulate."""
    level = level_of(scene.model)
    model = level.make_parameters(scene, geometry_of(bearing))
    state = equilibrium_state(model)
    method, steps = METHODS[scene.solver.name], level.steps_per_output(scene)
    return FullRun(model, method, state, np.zeros_like(state), scene.output_rate_hz, steps)


def run_full(stats: RunStatistics, settle: int, whole: int) -> Iterator[tuple[int, Outputs]]:
    """Run a model with the full model's equations from static balance; arguments as in `srbval.models.hierarchy`."""
    scene = stats.scene
    run = start_full_run(scene, stats.bearing)
    model = run.model
    load_n = float(model.drive.load[1, 0])
    spring_n = model.housing_stiffness * run.state[layout_of(run.state).ring]
    push_n = np.array([model.drive.direction_cosine, model.drive.direction_sine, 0.0]) * load_n
    stats.figures["balanced_share"] = load_share(scene, spring_n - push_n, load_n)  # load minus spring force
    weight_n = -model.ring_mass * model.gravity
    stats.ring = RingSupport(model.ring_mass, weight_n, model.housing_stiffness, model.housing_damping)
    methods = run.method, METHODS[default_solver()]
    limits = (elastic_limit_s(method, model, run.state) or math.inf for method in methods)
    stats.figures |= zip(("step_s", "step_limit_s", "default_limit_s"), (run.step_s, *limits), strict=True)
    started = time.perf_counter()
    run.advance(0, 0)
    stats.compile_s += time.perf_counter() - started
    per_detail = scene.outputs_per_detail
    for first, count in split_run(settle, whole, per_detail, scene.output_rate_hz, run.steps_per_output):
        with stats.timed():
            steps = run.advance(first, count, per_detail if first >= settle else 0)
        yield first, steps
    if scene.oil is not None or scene.bodies.free_rollers:
        stats.figures |= slices_figures(scene, stats.bearing, run, whole)


def slices_figures(scene: Scene, bearing: Bearing, run: FullRun, whole: int) -> dict[str, Any]:
    """Fields of `RunSummary` for oil films and for rollers that tilt (slices model), after `whole` output intervals."""
    from srbval.models.slices import MIN_LOAD_SHARE, films_m  # the only model with either

    found: dict[str, Any] = {}
    load_n = rates(run.model, whole / run.output_rate_hz, run.state).load_n.sum(axis=2)
    if scene.oil is not None:
        cage_rad_s = float(run.state[layout_of(run.state).shaft_cage_rate][0])
        middle, least = films_m(scene, geometry_of(bearing), run.model, load_n, cage_rad_s)
        found["film_um"] = {"min": 1e6 * float(least.min()), "mean": 1e6 * float(middle.mean())}
        found["lambda_min"] = float(least.min()) / scene.oil.roughness_m
    if scene.bodies.free_rollers:
        by_row = load_n[0].reshape(2, -1)
        carries = by_row.T.ravel() > MIN_LOAD_SHARE * by_row.max()  # in the order of the workspace
        tilt, shift, skew = (
            float(np.abs(run.model.space[int(row) :][: by_row.size][carries]).max(initial=0.0))
            for row in (col.TILT_SINE, col.SHIFT_ALONG, col.SKEW_MOMENT)
        )
        share = float(by_row[0].sum() / by_row.sum()) if by_row.any() else math.nan
        largest = {"tilt_mrad": 1e3 * tilt, "shift_um": 1e6 * shift, "skew_nm": skew}
        found["free_rollers"] = largest | {"row_1_share": share}
    return found
