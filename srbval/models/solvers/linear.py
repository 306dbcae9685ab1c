"""A linear mechanical system, for the stability of methods."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, eq=False)
class Linear:
    """q' = `motion` v, v' = `stiffness` q + `damping` v: shapes [q, v], [v, q] and [v, v].

    Of the full model, q are slides, cage angles and ring displacement, v all generalised speeds; the rollers' angles
    about their axes are left out, as nothing depends on them unless a roller is damaged.
    """

    motion: FloatArray
    stiffness: FloatArray
    damping: FloatArray

    @property
    def matrix(self) -> FloatArray:
        """The system's matrix, [q + v, q + v]."""
        still = np.zeros((len(self.motion), len(self.motion)))
        return np.block([[still, self.motion], [self.stiffness, self.damping]])
