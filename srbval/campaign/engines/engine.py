"""What a campaign needs of an engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from srbval.campaign.task import Outcome as Outcome
from srbval.campaign.task import Task
from srbval.scene import Scene

ATTEMPTS = 3  # of a case whose process dies: the system may have killed it for another's sake


@dataclass(frozen=True, kw_only=True)
class Job:
    """What an engine is asked to do: compile for `first`, then run `tasks` in their order.

    `begun` is to be called with a case's name when it is handed out; `suspects` were under way when the campaign was
    killed before, so they may be what killed it. `folder` is the campaign's.
    """

    folder: Path
    first: Sequence[Scene]
    tasks: Tasks
    begun: Callable[[str], None]
    suspects: frozenset[str] = frozenset()


class Tasks(Protocol):
    """Cases in their order; made as they are asked for, so that ten thousand scenes need not be held."""

    def __len__(self) -> int: ...

    def __iter__(self) -> Iterator[Task]: ...


class Engine(Protocol):
    """Runs cases somewhere."""

    name: str
    workers: int

    def run(self, job: Job) -> Iterator[Outcome]:
        """Outcomes as they come, one a task. Closing the iterator ends all that still runs."""
        ...


def crashed(key: str, how: str) -> Outcome:
    """The outcome of a case that took its process with it each time it was tried."""
    from srbval.campaign.task import Ending

    return Outcome(
        key=key,
        ending=Ending.CRASHED,
        reason=f"its process died {ATTEMPTS} times ({how}); the other cases were run without it",
    )
