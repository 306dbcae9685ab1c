"""Run in a process of its own by `processes`: compile everything, or simulate and read the peak memory.

``python -m srbval.studies.speed_accuracy.child compile`` or ``... memory SECONDS``; prints one JSON object.
"""

import json
import sys
from typing import Any

from srbval.models.simulate import Step, simulate
from srbval.models.solvers import SOLVERS
from srbval.processes.machine import peak_bytes
from srbval.studies.scenes import bench_scene

SHORTEST_S = 0.001  # simulated, to compile what a run needs


def compile_all() -> dict[str, Any]:
    """Compile time of the kernels behind each solver [s], in the order they are named: shared ones count once."""
    scenes = [bench_scene("play0-outer", solver=solver, seconds=SHORTEST_S, settle_s=0.0) for solver in SOLVERS]
    times = {scene.solver.name: simulate(scene, step=Step.UNCHECKED).compile_s for scene in scenes}
    return {"compile_s": sum(times.values()), "by_solver": times}


def peak_memory(seconds: float) -> dict[str, Any]:
    """Peak resident memory of this process after a run of the paper's scene [bytes]; None where it is not known."""
    run = simulate(bench_scene("play0-outer", solver="ode4", seconds=seconds, settle_s=0.0), step=Step.UNCHECKED)
    return {"seconds": run.seconds, "peak_bytes": peak_bytes()}


if __name__ == "__main__":
    answer = compile_all() if sys.argv[1] == "compile" else peak_memory(float(sys.argv[2]))
    print(json.dumps(answer))
