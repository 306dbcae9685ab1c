"""What is not known exactly of the scene `rig`: ranges with their sources, from `rig_inputs.toml`."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from srbval.errors import ConfigurationError
from srbval.scene.read import bundled_table, merge
from srbval.storage.tables import build

DRAWS_SEED = 17


@dataclass(frozen=True, kw_only=True)
class RigInput:
    """An uncertain value of the scene `rig`, from `low` to `high`, in `unit` as a scene file writes it.

    `key`: dotted path in a scene file; `points`: how many values, evenly spaced, a study tries.
    """

    key: str
    nominal: float
    low: float
    high: float
    points: int
    stands_for: str
    source: str
    unit: str = ""

    def __post_init__(self) -> None:
        if not (self.low <= self.nominal <= self.high and self.low < self.high and self.points >= 2):
            raise ConfigurationError(
                f"{self.key}: low = {self.low:g}, nominal = {self.nominal:g}, high = {self.high:g} must rise, and "
                f"points = {self.points} be two or more."
            )

    @property
    def values(self) -> tuple[float, ...]:
        """The values to try, from the lowest to the highest."""
        steps = self.points - 1
        return tuple(self.low + (self.high - self.low) * i / steps for i in range(self.points))

    def changes(self, value: float) -> dict[str, Any]:
        """What gives a scene this value, for `load_scene`."""
        *tables, name = self.key.split(".")
        changes: dict[str, Any] = {name: f"{value!r} {self.unit}" if self.unit else value}
        for table in reversed(tables):
            changes = {table: changes}
        return changes


def rig_inputs(kind: str = "input") -> tuple[RigInput, ...]:
    """All of a kind: ``input``, or ``position`` of a record's hole, which the cage ratio does not know."""
    return tuple(build(RigInput, table, f"rig_inputs.toml {kind} {i}") for i, table in
                 enumerate(bundled_table("rig_inputs")[kind], start=1))  # fmt: skip


def draws(inputs: Sequence[RigInput], power: int, *, seed: int = DRAWS_SEED) -> list[dict[str, Any]]:
    """Changes of all inputs at once, ``2**power`` from a Sobol sequence; those with two points take an end."""
    from scipy.stats import qmc

    unit = qmc.Sobol(d=len(inputs), scramble=True, rng=np.random.default_rng(seed)).random_base2(power)
    found = []
    for row in unit.tolist():
        changes: dict[str, Any] = {}
        for one, share in zip(inputs, row, strict=True):
            place = float(round(share)) if one.points == 2 else share
            changes = merge(changes, one.changes(one.low + place * (one.high - one.low)))
        found.append(changes)
    return found
