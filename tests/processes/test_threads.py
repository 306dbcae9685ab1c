"""One thread for numerical libraries, however many threads of the program ask for it at the same time."""

from __future__ import annotations

import numpy as np
from threadpoolctl import threadpool_info, threadpool_limits

from srbval.processes.machine import one_thread


def threads() -> set[int]:
    assert np.linalg.norm(np.eye(2)) > 0  # the library is loaded
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


def test_the_last_to_leave_restores_what_was_before_the_first_came() -> None:
    with threadpool_limits(2):
        first, second = one_thread(), one_thread()
        first.__enter__()
        second.__enter__()
        first.__exit__(None, None, None)
        assert threads() == {1}
        second.__exit__(None, None, None)
        assert threads() == {2}
