"""Fill or load the kernel cache by the shortest run of a model.

``python -m srbval.models.precompile MODEL`` is the process that `jit.precompile` starts.
"""

import contextlib
import sys
import threading
from collections.abc import Iterable

from srbval.errors import SrbvalError
from srbval.models.jit import WITHOUT_KERNELS, compile_in_this_process, precompile
from srbval.models.simulate import Step, simulate
from srbval.processes.worker import end_with_input
from srbval.scene import paper_scene

SHORTEST_S = 0.001  # simulated, to compile what a run needs

_loaded: set[str] = set()
_lock = threading.RLock()


def load_kernels(models: Iterable[str]) -> None:
    """Load the kernels of `models` into this process; precompile what is missing.

    For whoever runs several models in threads or times them: no run then waits for another's kernels.
    """
    with _lock:
        for model in sorted(set(models) - set(WITHOUT_KERNELS) - _loaded):
            _loaded.add(model)
            precompile(model)
            with contextlib.suppress(SrbvalError):  # the run itself will say what is wrong
                shortest_run(model)


def shortest_run(model: str) -> None:
    """Simulate just long enough to use every kernel of `model`."""
    simulate(paper_scene(model=model, duration_s=SHORTEST_S, settle_s=0.0), step=Step.UNCHECKED)


if __name__ == "__main__":
    end_with_input()
    for name in sys.argv[1:]:
        compile_in_this_process(name)
        shortest_run(name)
