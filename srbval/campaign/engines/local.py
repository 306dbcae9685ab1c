"""Worker processes of this machine, one for the engine `serial`.

Each worker process has a thread here that starts another when it dies. The standard pools, and pebble's too, give up
everything that is running when a process dies at the wrong moment; the standard ones do not say whose case it was.
"""

import queue
import threading
from collections.abc import Generator

from srbval.campaign.case import CaseOutcome
from srbval.campaign.engines.case_process import CaseProcess, StoppedError
from srbval.campaign.engines.engine import KEPT, Job
from srbval.errors import DataError


class LocalProcesses:
    """`workers` processes of one thread each."""

    def __init__(self, workers: int, *, name: str = "local") -> None:
        self.workers, self.name = workers, name

    def run(self, job: Job) -> Generator[CaseOutcome]:
        """Outcomes as they come. A case whose process dies is tried again in a new one, `ATTEMPTS` times in all."""
        tasks, lock = iter(job.tasks), threading.Lock()
        outcomes: queue.Queue[CaseOutcome | BaseException] = queue.Queue()

        def keep_busy(process: CaseProcess) -> None:
            try:
                process.prepare()
                while True:
                    with lock:
                        task = next(tasks, None)
                    if task is None:
                        return
                    outcomes.put(process.run(task))
            except StoppedError:
                return
            except BaseException as error:
                outcomes.put(error)
            finally:
                process.close()

        processes = [CaseProcess(job.precompiled) for _ in range(min(self.workers, job.count))]
        threads = [threading.Thread(target=keep_busy, args=(process,), daemon=True) for process in processes]
        try:
            for thread in threads:
                thread.start()
            for _ in range(job.count):
                outcome = outcomes.get()
                if isinstance(outcome, BaseException):
                    raise outcome
                yield outcome
        except (OSError, RuntimeError, MemoryError) as error:  # no process or thread more
            text = f"the operating system refused to start a process ({error}). {KEPT} Use fewer --jobs."
            raise DataError(text) from None
        finally:
            for process in processes:
                process.stop()
            for thread in threads:
                if thread.ident is not None:
                    thread.join()
