"""What a term of numerics or inputs does to the shape of the model's spectrum, beside any record."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.validation.analyse import Analysis
from srbval.validation.spectrum_shape import angle_between, halves


@dataclass(frozen=True, kw_only=True)
class ShapeEffect:
    """A term's run and the base run as spectra of one defect (see `spectrum_shape.halves`), [2, bins] each."""

    term: str
    kind: str
    source: str
    defect: str
    base: Sequence[Sequence[float]]
    varied: Sequence[Sequence[float]]

    def bound_beside(self, rig: NDArray[np.float64]) -> float:
        """What the term does to the model's angle with a record's halves, [2, bins] [degrees]."""
        angles = [angle_between(rig, np.asarray(x)).degrees for x in (self.base, self.varied)]
        return abs(angles[1] - angles[0])


def shape_of(analysis: Analysis, line: str) -> NDArray[np.float64] | None:
    """The halves of a record about a line of it, None where the line or the bins are out of reach."""
    found = analysis.line(line).found_hz
    return None if found is None else halves(analysis, found)
