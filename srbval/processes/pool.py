"""Functions called in several processes, because Python runs only one thread at a time."""

import signal
import sys
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from multiprocessing import get_context
from typing import TypeVar

from srbval.errors import DataError
from srbval.processes.machine import usable_cores

Item = TypeVar("Item")
Result = TypeVar("Result")


def in_processes(
    function: Callable[[Item], Result], items: Sequence[Item], *, jobs: int | None = None
) -> Iterator[tuple[Item, Result]]:
    """Call `function` for each item in several processes; yields item and result in the order of completion.

    `jobs` processes run at a time, by default one per core; they ignore Ctrl-C. A single item is computed in this
    process. The function, the items and the results must be picklable. Raises the exceptions of `function`, and
    `DataError` if a process dies.
    """
    if len(items) < 2:
        yield from ((item, function(item)) for item in items)
        return
    main = sys.modules["__main__"]
    count, ignore = min(jobs or usable_cores(), len(items)), (signal.SIGINT, signal.SIG_IGN)
    with ProcessPoolExecutor(count, get_context("spawn"), initializer=signal.signal, initargs=ignore) as pool:
        script = {name: vars(main).pop(name, None) for name in ("__file__", "__spec__")}
        main.__spec__ = None  # otherwise a spawned process would run the user's script
        try:
            running = {pool.submit(function, item): item for item in items}
        finally:
            vars(main).update({name: value for name, value in script.items() if value or name == "__spec__"})
        try:
            yield from ((running[future], future.result()) for future in as_completed(running))
        except BrokenProcessPool:
            raise DataError(
                "a worker process died, perhaps for lack of memory. Finished work is kept, and the same command "
                "continues from there; use fewer --jobs."
            ) from None
        finally:
            pool.shutdown(cancel_futures=True)
