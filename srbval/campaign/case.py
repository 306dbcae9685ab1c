"""The cases of a campaign: as planned, as handed to a worker, as ended; and the keys of their results."""

import enum
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.campaign.quantities import Output
from srbval.models.run import USABLE
from srbval.models.run_file import scene_content
from srbval.scene import Scene
from srbval.storage.sources import content_version
from srbval.storage.stored_result import content_key

COMPUTED_BY = "srbval.campaign.work"
KEY = re.compile("[0-9a-f]{32}")  # of a result
GUESSED_S = 2e-5  # wall time of one right-hand side of the full model on a slow machine


class Ending(enum.StrEnum):
    """How a case ended. The `usable`, `FAILED` and `REFUSED` are final; the others are tried again by the next run."""

    OK = "ok"
    INACCURATE = "inaccurate"  # these three as in `RunStatus`, with a result
    SKIDDING = "skidding"
    ROLLERS_UNLOADED = "rollers-unloaded"
    FAILED = "failed"  # the numerics: the reason begins with the run's own status
    REFUSED = "refused"  # no run could be started
    CRASHED = "crashed"  # its process died, or the program has a bug
    TIMED_OUT = "timed-out"  # it exceeded its time limit, so its process was ended
    UNWRITTEN = "unwritten"  # the result could not be written

    @property
    def usable(self) -> bool:
        """Is there a result that may be read as the vibration of the scene's bearing?"""
        return self.value in USABLE


FINAL = (*(ending for ending in Ending if ending.usable), Ending.FAILED, Ending.REFUSED)
RETRIED = (Ending.CRASHED, Ending.TIMED_OUT)  # endings with a result file that is removed for another try


@dataclass(frozen=True, kw_only=True, slots=True)
class CampaignCase:
    """A case as planned.

    `key` names its result; `point` is what it changes in the base scene, by dotted key; `weight` is its cost in
    right-hand sides of the full model; `expected_s` the wall time on the calibration's machine, None where unknown;
    `refused` says why no scene could be made of the point.
    """

    index: int
    key: str
    point: Mapping[str, Any]
    model: str
    solver: str
    weight: float
    expected_s: float | None
    expected_bytes: int
    refused: str | None = None

    @property
    def planned_s(self) -> float:
        """`expected_s`, or a rough guess from the weight where that is unknown; the longest cases run first."""
        return GUESSED_S * self.weight if self.expected_s is None else self.expected_s


@dataclass(frozen=True, kw_only=True)
class CaseTask:
    """What a worker needs to run a case.

    The scene, the outputs wanted, where the result goes, and the limit of wall time, None for none.
    """

    key: str
    scene: Scene
    outputs: tuple[Output, ...]
    path: Path
    limit_s: float | None = None


@dataclass(frozen=True, kw_only=True)
class CaseOutcome:
    """How a case ended; `wall_s` of the whole case, `simulation_s` of the simulation alone.

    `found`: the result existed already and nothing was run.
    """

    key: str
    ending: Ending
    reason: str
    wall_s: float = 0.0
    simulation_s: float = 0.0
    found: bool = False


def case_key(scene: Scene, outputs: Sequence[Output]) -> str:
    """Key of a result: hash of the scene, the bearing's data, the outputs and the version of the code."""
    return content_key(f"{' '.join(sorted(outputs))} {scene_content(scene)}", computed_by=COMPUTED_BY)


def refused_key(point: Mapping[str, Any], reason: str) -> str:
    """Key of the result of a point of which no scene could be made."""
    return content_key(f"{json.dumps(point, sort_keys=True, default=str)} {reason}", computed_by=COMPUTED_BY)


def version() -> str:
    """Version of everything that runs a case and measures it."""
    return content_version(COMPUTED_BY)
