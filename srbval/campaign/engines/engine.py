"""The interface of an engine."""

from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from srbval.campaign.case import CaseOutcome, CaseTask, Ending
from srbval.scene import Scene

ATTEMPTS = 3  # per case whose process dies: the system may have killed it because of another process's memory

KEPT = "Results received so far are kept; the same command resumes from there."


@dataclass(frozen=True, kw_only=True)
class Job:
    """What an engine is asked to do: compile for the scenes `precompiled`, then run the `count` `tasks` in order.

    `tasks` are made as they are asked for, so that ten thousand scenes need not be in memory; `folder` is the
    campaign's.
    """

    folder: Path
    precompiled: Sequence[Scene]
    tasks: Iterable[CaseTask]
    count: int


class Engine(Protocol):
    """Runs cases somewhere."""

    name: str
    workers: int

    def run(self, job: Job) -> Generator[CaseOutcome]:
        """Outcomes as they come, one per task. Closing the generator ends everything that still runs."""
        ...


def timed_out(task: CaseTask) -> CaseOutcome:
    """The outcome of a case that took longer than its limit."""
    reason = (
        f"it took longer than its limit of {task.limit_s:.6g} s, so its process was ended; the other cases were run. "
        "If it only needs longer: --limit-factor, --least-limit, or limit_factor and least_limit in the campaign file"
    )
    return CaseOutcome(key=task.key, ending=Ending.TIMED_OUT, reason=reason, wall_s=task.limit_s or 0.0)


def crashed(key: str, how: str) -> CaseOutcome:
    """The outcome of a case whose process died each time it was tried; `how` completes "its ..."."""
    return CaseOutcome(key=key, ending=Ending.CRASHED, reason=f"its {how}; the other cases were run without it")
