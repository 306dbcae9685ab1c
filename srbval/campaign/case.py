"""One case of a campaign: what it changes, the name of its result, what it should cost."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import Any

import srbval
from srbval.bearing import load_bearing
from srbval.campaign.quantities import Output
from srbval.models.kernel_cache import kernel_cache_folder
from srbval.models.run_file import scene_dict
from srbval.scene import Scene

# Sources beside the models' that decide what a result file holds.
MEASURED_BY = (
    "bearing/*.py", "signal/*.py", "validation/*.py", "recordings/from_run.py", "bench/measures.py",
    "campaign/quantities.py", "campaign/case_file.py", "scene/*.py",
)  # fmt: skip


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
    content = json.dumps(scene_dict(scene), sort_keys=True) + _bearing(scene.bearing)
    return _digest(f"{version()} {' '.join(sorted(outputs))} {content}")


def refused_key(point: Mapping[str, Any], reason: str) -> str:
    """Name of the result of a case of which no scene could be made."""
    return _digest(f"{version()} {json.dumps(point, sort_keys=True, default=str)} {reason}")


@cache
def version() -> str:
    """Content of the models' kernels and of what measures their runs."""
    package = Path(srbval.__file__).parent
    digest = hashlib.sha256(kernel_cache_folder().name.encode())
    for pattern in MEASURED_BY:
        for source in sorted(package.glob(pattern)):
            digest.update(source.read_bytes())
    return digest.hexdigest()[:16]


@cache
def _bearing(name: str) -> str:
    return repr(load_bearing(name))


def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
