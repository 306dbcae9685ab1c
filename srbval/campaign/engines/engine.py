"""The interface of an engine."""

from collections.abc import Generator, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from srbval.campaign.case import CaseResult, CaseTask
from srbval.scene import Scene

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

    def run(self, job: Job) -> Generator[CaseResult]:
        """Results as they come, one per task. Closing the generator ends everything that still runs."""
        ...
