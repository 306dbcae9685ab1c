"""Uncertain inputs of the paper's scene, with their ranges and alternatives, from `budget.toml`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from srbval.comparison.comparison import BUDGET
from srbval.models.run_file import scene_dict
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import Scene, merge
from srbval.storage.tables import build, nest_value, read_toml, walk_leaves

BAND_KEYS = ("band.low_hz", "band.high_hz")
POINTS, LOG_POINTS = 3, 9  # values of an input that is varied alone: uniform, log-uniform


@dataclass(frozen=True, kw_only=True)
class OpenInput:
    """Uncertain input of a scene, with its probability distribution.

    `keys` are dotted names in a `Scene` that all get the same value, or an end of the envelope band, ``band.low_hz`` or
    ``band.high_hz``. The value is uniform from `low` to `high`, log-uniform if `log`, a factor on the scene's own value
    if `relative`. Or it is one of `choices`, equally likely; `with_choice` contains other values of the scene, by
    dotted name, that change with a choice.
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
        """Cumulative probabilities of the values that a study simulates when it varies this input alone."""
        ends, points = (False, len(self.choices)) if self.choices else (True, LOG_POINTS if self.log else POINTS)
        return tuple(np.linspace(0, 1, points, endpoint=ends).tolist())

    def value(self, share: float) -> float | str:
        """Value of the input, or its factor if `relative`, at the cumulative probability `share`, 0 to 1."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        if self.log:
            return float(self.low * (self.high / self.low) ** share)
        return self.low + (self.high - self.low) * share


DrawnScene = tuple[Scene, tuple[float, float]]  # a scene, and the band of the envelope [Hz]


def scene_at_shares(inputs: Sequence[OpenInput], scene: Scene, shares: Sequence[float | None]) -> DrawnScene:
    """Set every input to the value at its share (cumulative probability); None keeps the scene's own value.

    Returns the scene and the envelope band [Hz]. Raises `ConfigurationError` for an input that the scene lacks.
    """
    table, band = scene_dict(scene), dict(zip(BAND_KEYS, SIMULATED_BAND_HZ, strict=True))
    present = dict(walk_leaves(table))
    for one, share in ((one, share) for one, share in zip(inputs, shares, strict=True) if share is not None):
        value = one.value(share)
        if of_reading(one):
            band[one.keys[0]] = float(value)
            continue
        changes = {key: present[key] * value if one.relative else value for key in one.keys}
        for key, changed in {**changes, **one.with_choice.get(str(value), {})}.items():
            table = merge(table, nest_value(key, changed))
    low_hz, high_hz = band.values()
    return build(Scene, table, BUDGET.name), (low_hz, high_hz)


def of_reading(one: OpenInput) -> bool:
    """True if the input is an end of the envelope band, which concerns the analysis of a signal, not the scene."""
    return one.keys[0] in BAND_KEYS


def open_inputs() -> tuple[OpenInput, ...]:
    """Load the uncertain inputs of the paper's scene; the ends of the envelope band come last."""
    return tuple(build(OpenInput, row, f"{BUDGET.name} {row['name']}") for row in read_toml(BUDGET)["input"])
