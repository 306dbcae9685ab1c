"""The interface of an engine."""

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from srbval.campaign.case import CaseOutcome, CaseTask, Ending
from srbval.scene import Scene

ATTEMPTS = 3  # per case whose process dies: the system may have killed it because of another process's memory


@dataclass(frozen=True, kw_only=True)
class Job:
    """What an engine is asked to do: compile for the scenes `precompiled`, then run the `count` `tasks` in order.

    `tasks` are made as they are asked for, so that ten thousand scenes need not be in memory. `started` is to be called
    with a case's key when it is handed out; `suspects` were running when the campaign was killed before, so one of them
    may have caused that. `folder` is the campaign's.
    """

    folder: Path
    precompiled: Sequence[Scene]
    tasks: Iterable[CaseTask]
    count: int
    started: Callable[[str], None]
    suspects: frozenset[str] = frozenset()


class Engine(Protocol):
    """Runs cases somewhere."""

    name: str
    workers: int

    def run(self, job: Job) -> Generator[CaseOutcome]:
        """Outcomes as they come, one per task. Closing the generator ends everything that still runs."""
        ...


def crashed(key: str, how: str) -> CaseOutcome:
    """The outcome of a case whose process died each time it was tried; `how` completes "its ..."."""
    return CaseOutcome(key=key, ending=Ending.CRASHED, reason=f"its {how}; the other cases were run without it")
