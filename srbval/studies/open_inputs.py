"""What is not known exactly of a scene: ranges and readings of its values, from `budget.toml` or a user's file."""

import bisect
import enum
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from srbval.comparison.budget import BUDGET
from srbval.errors import ConfigurationError
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import Scene
from srbval.storage.tables import build, read_toml

BAND = "band"


@dataclass(frozen=True, kw_only=True)
class OpenInput:
    """An uncertain value, of all `keys` alike: dotted names in a `Scene`, or ``band.low_hz`` and ``band.high_hz``.

    Uniform from `low` to `high`, in the logarithm where `log`, of factors on the scene's own value where `relative`;
    or one of `choices` with `weights`. `with_choice`: what else of the scene goes with a choice, by key.
    """

    name: str
    source: str
    keys: tuple[str, ...]
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    relative: bool = False
    choices: tuple[str, ...] = ()
    weights: tuple[float, ...] = ()
    with_choice: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.choices and (len(self.weights) != len(self.choices) or not math.isclose(sum(self.weights), 1)):
            raise ConfigurationError(f"input {self.name}: one weight for each of the choices, one in sum, is needed.")
        if not self.choices and not (self.low < self.high and (self.low > 0 or not self.log)):
            raise ConfigurationError(f"input {self.name}: low = {self.low:g} must be below high = {self.high:g}.")

    def coordinate(self, share: float) -> float:
        """Where a share of the probability, 0 to below 1, lies between the ends, 0 to 1: of choices a step."""
        if not self.choices:
            return share
        chosen = bisect.bisect_right(list(itertools.accumulate(self.weights))[:-1], share)
        return chosen / (len(self.choices) - 1)

    def value(self, share: float) -> float | str:
        """The value, or the factor, at a share of the probability."""
        if self.choices:
            return self.choices[round(self.coordinate(share) * (len(self.choices) - 1))]
        if self.log:
            return float(self.low * (self.high / self.low) ** share)
        return self.low + (self.high - self.low) * share


Drawn = tuple[Scene, tuple[float, float]]  # a scene, and the band of the envelope [Hz]


def drawn(inputs: Sequence[OpenInput], scene: Scene, shares: Sequence[float]) -> Drawn:
    """The scene and the envelope's band with every input at its share; `ConfigurationError` for one it has not."""
    band = dict(zip(("low_hz", "high_hz"), SIMULATED_BAND_HZ, strict=True))
    for one, share in zip(inputs, shares, strict=True):
        for key in one.keys:
            if key.startswith(f"{BAND}."):
                band[key.removeprefix(f"{BAND}.")] = float(one.value(share))
            else:
                scene = _with(scene, key, one.value(share), one.relative)
        for key, value in one.with_choice.get(str(one.value(share)), {}).items():
            scene = _with(scene, key, value, relative=False)
    return scene, (band["low_hz"], band["high_hz"])


def _with(owner: Any, key: str, value: float | str, relative: bool) -> Any:
    """`owner` with the value of a dotted name, or that times it."""
    name, _, rest = key.partition(".")
    if not hasattr(owner, name):
        raise ConfigurationError(f"input {key}: a scene has no {name}.")
    own = getattr(owner, name)
    if rest:
        return replace(owner, **{name: _with(own, rest, value, relative)})
    if isinstance(own, enum.Enum):
        return replace(owner, **{name: type(own)(value)})
    return replace(owner, **{name: own * value if relative else value})


def open_inputs(path: Path | None = None) -> tuple[OpenInput, ...]:
    """Those of a file, which has nothing else in it, or of the paper's scene."""
    file, document = path or BUDGET, read_toml(path or BUDGET)
    if other := set(document) - ({"input"} if path else {"input", "form", "prior", "study", "tolerance", "verdict"}):
        raise ConfigurationError(f"{file.name}: unknown table {min(other)!r}; only [[input]] is read.")
    rows = document.get("input", [])
    if not rows:
        raise ConfigurationError(f"{file.name}: at least one [[input]] is needed.")
    return tuple(build(OpenInput, row, f"{file.name} input {i}") for i, row in enumerate(rows, start=1))
