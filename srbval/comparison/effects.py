"""What inputs, starts and numerics do to the compared quantities of one defect, all of them together."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Fault
from srbval.comparison.spectrum_shape import excess, with_noise

INPUTS, GRID = "inputs: all together", "numerics: points and step"
REPEATS, SEED = 20, 4  # of a draw's spectrum in noise


@dataclass(frozen=True, kw_only=True)
class QuantityEffects:
    """Of one quantity, in its `unit`: the scene's own value at the converged model, and what moves it.

    `shift`: the mean over the inputs less that value; `deviation`: one standard deviation over the inputs and starts;
    `shares` of its variance by each input on its own. `grid_ci95`: what points and step still leave open;
    `paper_points` and `paper_points_ci95`: what the paper's number of points does (its value less the converged one),
    an offset with a sign. `start_sd` and `paper_start_sd`: scatter over starts of the compared length. `outside`: share
    of the runs that the emulator, fitted to the others, misses by more than two deviations.
    """

    name: str
    unit: str
    value: float
    shift: float
    deviation: float
    shares: Mapping[str, float]
    grid_ci95: float
    paper_points: float | None
    paper_points_ci95: float | None
    start_sd: float
    paper_start_sd: float | None
    outside: float


@dataclass(frozen=True, kw_only=True)
class DefectEffects:
    """Effects on all quantities of one defect: `predicted` are they over inputs and starts, [many, quantities].

    `draws` runs were used, `failed` ones were not; `refined`: whether the first round of them was not enough for the
    emulator. `at` are their inputs, [draws, inputs] in 0 to 1, `values` their quantities, [draws, quantities], None
    where a run did not show one. `spectra` are those of the draws that show the line, `spectrum` that of the scene
    itself (see `spectrum_shape.halves_of`), [2, bins] each.
    """

    defect: str
    quantities: tuple[QuantityEffects, ...]
    draws: int
    failed: int
    refined: bool
    predicted: Sequence[Sequence[float]] = field(repr=False)
    at: Sequence[Sequence[float]] = field(default=(), repr=False)
    values: Sequence[Sequence[float | None]] = field(default=(), repr=False)
    spectra: Sequence[Sequence[Sequence[float]]] = field(default=(), repr=False)
    spectrum: Sequence[Sequence[float]] | None = field(default=None, repr=False)

    def of(self, name: str) -> QuantityEffects | None:
        """Those on one quantity."""
        return next((one for one in self.quantities if one.name == name), None)

    def deviations(self, names: Sequence[str]) -> NDArray[np.float64]:
        """What predicted quantities lie off their mean, [many, names]."""
        places = [[one.name for one in self.quantities].index(name) for name in names]
        means = np.array([self.quantities[place].value + self.quantities[place].shift for place in places])
        return np.asarray(np.array(self.predicted)[:, places] - means)

    def inputs_ci95(self, name: str) -> float:
        """Half width that holds a new draw of the inputs with a chance of 95 %: by rank, since they are not normal."""
        off = np.sort(np.abs(self.deviations([name])[:, 0]))
        return float(off[min(math.ceil(0.95 * (off.size + 1)), off.size) - 1])

    def right_model_excess(self, snr: float, cells: float) -> NDArray[np.float64] | None:
        """`spectrum_shape.excess` over the scene's own spectrum of its draws, read in noise again and again [degrees].

        [draws, repeats]; `snr` and `cells` as in `spectrum_shape.with_noise`. None where no spectra are known.
        """
        if self.spectrum is None or not self.spectra:
            return None
        own, rng = np.array(self.spectrum), np.random.default_rng(SEED)
        draws = (np.repeat(np.array(one)[None], REPEATS, axis=0) for one in self.spectra)
        return np.array([excess(own, with_noise(one, snr, cells, rng)) for one in draws])


@dataclass(frozen=True, kw_only=True)
class Sensitivity:
    """The effects that were measured, by defect."""

    defects: tuple[DefectEffects, ...] = ()

    def of(self, fault: Fault) -> DefectEffects | None:
        """Those of a fault."""
        return next((one for one in self.defects if one.defect == fault.value), None)


NO_SENSITIVITY = Sensitivity()


def sensitivity_of(stored: Mapping[str, Any]) -> Sensitivity:
    """From plain values, as stored."""
    return Sensitivity(
        defects=tuple(
            DefectEffects(**one | {"quantities": tuple(QuantityEffects(**row) for row in one["quantities"])})
            for one in stored.get("defects", ())
        )
    )
