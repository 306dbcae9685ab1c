"""Effects of numerics and inputs: of each term on a compared quantity, and on the shape of the spectrum."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.validation.spectrum_shape import angle_between


@dataclass(frozen=True, kw_only=True)
class _TermEffect:
    """What one term (or ensemble of terms) does to the lines of one defect."""

    term: str
    kind: str
    source: str
    defect: str

    @property
    def part(self) -> str:
        """The term as a part of an uncertainty."""
        return f"{self.kind}: {self.term}"


@dataclass(frozen=True, kw_only=True)
class Effect(_TermEffect):
    """Effect on one quantity: a 95 % bound, in `unit`."""

    quantity: str
    unit: str
    base: float
    bound: float

    def of(self, fault: Fault, quantity: str) -> bool:
        """Whether it is one on this quantity of this fault."""
        return (self.defect, self.quantity) == (fault.value, quantity)

    @property
    def bound_pct(self) -> float:
        """The bound relative to the base, for quantities that have a size [%]."""
        return 100 * self.bound / abs(self.base)


@dataclass(frozen=True, kw_only=True)
class ShapeEffect(_TermEffect):
    """A term's run and the base run as spectra (see `spectrum_shape.halves_of`), [2, bins] each."""

    base: Sequence[Sequence[float]]
    varied: Sequence[Sequence[float]]

    def bound_with(self, rig: NDArray[np.float64]) -> float:
        """Change of the model's angle with a record's halves, [2, bins], by the term [degrees]."""
        angles = [angle_between(rig, np.asarray(x)).degrees for x in (self.base, self.varied)]
        return abs(angles[1] - angles[0])


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """All measured effects of numerics and inputs: on numbers and on the shape of the spectrum."""

    effects: tuple[Effect, ...] = ()
    shapes: tuple[ShapeEffect, ...] = ()


NO_SENSITIVITY = Sensitivity()


def sensitivity_of(stored: Mapping[str, Any]) -> Sensitivity:
    """From plain values, as stored."""
    return Sensitivity(
        effects=tuple(Effect(**row) for row in stored["effects"]),
        shapes=tuple(ShapeEffect(**row) for row in stored.get("shapes", ())),
    )
