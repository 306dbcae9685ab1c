"""What Dask workers run: cases in processes of their own, so that one that dies or hangs takes no worker with it."""

import platform
import threading
from dataclasses import dataclass
from pathlib import Path

from srbval.campaign.case import CaseOutcome, CaseTask
from srbval.campaign.engines.case_process import CaseProcess
from srbval.errors import ConfigurationError, DataError
from srbval.scene import Scene

_own = threading.local()  # the process of each thread; it ends by itself when no case comes for a while


@dataclass(frozen=True, kw_only=True)
class Terms:
    """What holds for all cases of a campaign: its folder, the code's version, the scenes to compile."""

    folder: Path
    version: str
    scenes: tuple[Scene, ...]


def run_on_worker(task: CaseTask, terms: Terms) -> CaseOutcome:
    """Run a case. `ConfigurationError` where this worker's code is another, `DataError` where it lacks the folder."""
    process: CaseProcess | None = getattr(_own, "process", None)
    if process is None or process.scenes != terms.scenes:
        process = _own.process = CaseProcess(terms.scenes)
    host = platform.node()
    if (theirs := process.prepare()) != terms.version:
        raise ConfigurationError(
            f"the Dask workers at {host} run another version of the model ({theirs}, here {terms.version}): results "
            "would not compare. Install the same srbval there."
        )
    if not terms.folder.is_dir():
        raise DataError(
            f"the Dask worker at {host} does not see {terms.folder}; choose a folder that all machines share."
        )
    outcome: CaseOutcome = process.run(task)
    return outcome
