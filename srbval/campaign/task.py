"""What an engine hands to a worker, and what comes back."""

from __future__ import annotations

import enum
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.quantities import Output
from srbval.scene import Scene


class Ending(enum.StrEnum):
    """How a case ended. `OK`, `FAILED` and `REFUSED` are final; the others are tried again when the campaign is."""

    OK = "ok"
    FAILED = "failed"  # the numerics: the run's own status is in the reason
    REFUSED = "refused"  # no run could be begun
    CRASHED = "crashed"  # its process died, or the program has a bug
    TIMED_OUT = "timed-out"  # it took longer than its limit, so its process was ended
    UNWRITTEN = "unwritten"  # the result could not be written


FINAL = (Ending.OK, Ending.FAILED, Ending.REFUSED)
LOST = (Ending.CRASHED, Ending.TIMED_OUT)  # what a result file may say that is tried again all the same


@dataclass(frozen=True, kw_only=True)
class Task:
    """A case to run: the scene, what is wanted of it, where its result goes; `limit_s` of wall time, None for none."""

    key: str
    scene: Scene
    outputs: tuple[Output, ...]
    path: Path
    limit_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """How a case ended; `wall_s` with everything about it, `simulation_s` of the simulation alone.

    `found`: the result was there already and nothing was run.
    """

    key: str
    ending: Ending
    reason: str
    wall_s: float = 0.0
    simulation_s: float = 0.0
    found: bool = False

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self) | {"ending": self.ending.value}
