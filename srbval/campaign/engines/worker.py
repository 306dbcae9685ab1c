"""The process of a `CaseProcess`, ``python -m srbval.campaign.engines.worker``: compiles, or runs a case."""

from collections.abc import Callable
from typing import Any

from srbval.processes.worker import serve_calls

IDLE_S = 60.0  # without a case: a Dask worker outlives campaigns


def load() -> Callable[[tuple[str, Any]], Any]:
    """Import what cases need; the function that answers ``("prepare", scenes)`` and ``("run", task)``."""
    from srbval.campaign.work import prepare, run_case

    return lambda request: prepare(request[1]) if request[0] == "prepare" else run_case(request[1])


if __name__ == "__main__":
    serve_calls(load, idle_s=IDLE_S)
