"""What a model hands over as it goes: a stretch of output intervals."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


class Outputs(Protocol):
    """`out`, one row per interval, see `output_columns`; spins and loads of the detailed outputs, if any.

    A column of NaN is a quantity that the model does not have.
    """

    @property
    def out(self) -> FloatArray:
        """One row an output interval."""

    @property
    def spin_rad_s(self) -> FloatArray:
        """Roller spins, [k, 2 M]."""

    @property
    def load_n(self) -> FloatArray:
        """Normal forces, [k, 2 races, 2 M rollers, 3 circles]."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Chunk:
    """Outputs of a model without detailed ones."""

    out: FloatArray
    spin_rad_s: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    load_n: FloatArray = field(default_factory=lambda: np.zeros((0, 2, 0, 3)))
