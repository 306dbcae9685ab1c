"""One case of a campaign: what it changes, the name of its result, what it should cost."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from srbval.bench.scenes import scene_content
from srbval.campaign.quantities import Output
from srbval.scene import Scene
from srbval.storage.content_store import content_key
from srbval.storage.content_version import content_version

COMPUTED_BY = "srbval.campaign.work"
GUESSED_S = 2e-5  # of wall time for one of the full model's right-hand sides, on a slow machine


@dataclass(frozen=True, kw_only=True, slots=True)
class Case:
    """A case as planned.

    `key` names its result; `point` is what it changes, by dotted key; `solver` the scene's; `weight` its cost in the
    full model's right-hand sides; `expected_s` on the calibration's machine, None where that is unknown; `refused` says
    why no scene could be made of it.
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
        """`expected_s`, or a rough guess from the weight where that is unknown; the longest go first."""
        return GUESSED_S * self.weight if self.expected_s is None else self.expected_s

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def case_key(scene: Scene, outputs: Sequence[Output]) -> str:
    """Name of a result: the scene, the bearing's data, the outputs, the version of all that makes and measures it."""
    return content_key(f"{' '.join(sorted(outputs))} {scene_content(scene)}", computed_by=COMPUTED_BY)


def refused_key(point: Mapping[str, Any], reason: str) -> str:
    """Name of the result of a case of which no scene could be made."""
    return content_key(f"{json.dumps(point, sort_keys=True, default=str)} {reason}", computed_by=COMPUTED_BY)


def version() -> str:
    """Version of everything that runs a case and measures it."""
    return content_version(COMPUTED_BY)
