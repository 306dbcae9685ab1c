"""Uncertain inputs of the paper's scene: ranges and readings of its values, from `budget.toml`."""

import enum
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from srbval.comparison.comparison import BUDGET
from srbval.errors import ConfigurationError
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import Scene
from srbval.storage.tables import build, read_toml

BAND_KEYS = ("band.low_hz", "band.high_hz")
POINTS, LOG_POINTS = 3, 9  # values of one input tried alone


@dataclass(frozen=True, kw_only=True)
class OpenInput:
    """An uncertain value, the same for all `keys`: dotted names in a `Scene`, or ``band.low_hz``, ``band.high_hz``.

    Uniform from `low` to `high`, in the logarithm if `log`, of factors on the scene's own value if `relative`; or one
    of `choices`, equally likely. `with_choice` gives further values of the scene for a choice, by key.
    """

    name: str
    source: str
    keys: tuple[str, ...]
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    relative: bool = False
    choices: tuple[str, ...] = ()
    with_choice: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def shares(self) -> tuple[float, ...]:
        """Shares to try alone: every choice, or evenly from end to end; over decades an effect rises and falls."""
        ends, points = (False, len(self.choices)) if self.choices else (True, LOG_POINTS if self.log else POINTS)
        return tuple(np.linspace(0, 1, points, endpoint=ends).tolist())

    def value(self, share: float) -> float | str:
        """The value, or the factor, at a share of the probability, 0 to 1."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        if self.log:
            return float(self.low * (self.high / self.low) ** share)
        return self.low + (self.high - self.low) * share


Drawn = tuple[Scene, tuple[float, float]]  # a scene, and the band of the envelope [Hz]


def drawn(inputs: Sequence[OpenInput], scene: Scene, shares: Sequence[float | None]) -> Drawn:
    """The scene and the envelope's band with every input at its share; None keeps the scene's own value.

    Raises `ConfigurationError` for an input that a scene does not have.
    """
    band = dict(zip(BAND_KEYS, SIMULATED_BAND_HZ, strict=True))
    for one, share in ((one, share) for one, share in zip(inputs, shares, strict=True) if share is not None):
        value = one.value(share)
        if of_reading(one):
            band[one.keys[0]] = float(value)
            continue
        for key in one.keys:
            scene = _replace_value(scene, key, value, one.relative)
        for key, own in one.with_choice.get(str(value), {}).items():
            scene = _replace_value(scene, key, own, relative=False)
    low_hz, high_hz = band.values()
    return scene, (low_hz, high_hz)


def of_reading(one: OpenInput) -> bool:
    """True for the ends of the envelope's band, which belong to the reading, not to the scene; they stand last."""
    return one.keys[0] in BAND_KEYS


def _replace_value(owner: Any, key: str, value: float | str, relative: bool) -> Any:
    """`owner` with the value of a dotted name, or with its own value times it if `relative`."""
    name, _, rest = key.partition(".")
    if not hasattr(owner, name):
        raise ConfigurationError(f"input {key}: a scene has no {name}.")
    own = getattr(owner, name)
    if rest:
        return replace(owner, **{name: _replace_value(own, rest, value, relative)})
    if isinstance(own, enum.Enum):
        return replace(owner, **{name: type(own)(value)})
    return replace(owner, **{name: own * value if relative else value})


def open_inputs() -> tuple[OpenInput, ...]:
    """The inputs of the paper's scene."""
    return tuple(build(OpenInput, row, f"{BUDGET.name} {row['name']}") for row in read_toml(BUDGET)["input"])
