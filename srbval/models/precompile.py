"""Process ``python -m srbval.models.precompile KERNEL ...`` of `jit.precompile`: compiles kernels into the cache."""

import gc
import sys
from dataclasses import replace
from functools import partial

import numpy as np

from srbval.bearing import load_bearing
from srbval.models.full.parameters import state_layout
from srbval.models.full.rates import rates
from srbval.models.full_run import FullRun
from srbval.models.hierarchy import geometry_of, level_of
from srbval.models.jit import FREE_SUFFIX, OIL_SUFFIX, RATES, RING, compile_and_list, compile_in_this_process
from srbval.models.simulate import Step, simulate
from srbval.models.solvers import FAMILIES, METHODS
from srbval.processes.worker import end_with_input
from srbval.scene import paper_scene

PRECOMPILED_RUN_S = 0.001  # length of a run that compiles its kernels


def compile_kernel(model: str, part: str, cages: str, *more: str) -> None:
    """Compile one kernel by calling it briefly; the arguments are the words of its name, see `kernels_of`."""
    in_oil = {"oil": {"iso_vg": 150}, "line_contact": {"traction": "film"}} if OIL_SUFFIX[1:] in more else {}
    scene = paper_scene(model=model, bodies={"cages": int(cages), "free_rollers": FREE_SUFFIX[1:] in more}, **in_oil)
    compile_in_this_process(scene)
    if part == RING:
        simulate(replace(scene, duration_s=PRECOMPILED_RUN_S, settle_s=0.0), step=Step.UNCHECKED)
        return
    parameters = level_of(model).make_parameters(scene, geometry_of(load_bearing(scene.bearing)))
    state = np.zeros(2 * state_layout(parameters).half)
    if part == RATES:
        rates(parameters, 0.0, state)
    else:
        method = next(method for method in METHODS.values() if FAMILIES[method.family] == part)
        FullRun(parameters, method, state, np.zeros_like(state), scene.output_rate_hz, 1).advance(0, 0)


if __name__ == "__main__":
    end_with_input()
    gc.disable()  # compiling creates millions of objects, few of them garbage
    for kernel in sys.argv[1:]:
        compile_and_list(kernel, partial(compile_kernel, *kernel.split("-")))
