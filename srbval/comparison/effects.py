"""The stored study of sensitivity: what inputs, starts and numerics do to the compared quantities of a defect."""

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
    """What moves one compared quantity of the model, in the quantity's `unit`.

    `value` is that of the scene with its own inputs and enough points on a circle, a mean over starts; `shift` what the
    mean over all inputs lies above it; `deviation` one standard deviation over inputs and starts together, and `shares`
    the part of that variance which each input makes on its own. `grid_ci95`: what the number of points and the step
    still leave open. `paper_points` is what the paper's number of points adds to `value`, an offset with a sign, with
    its 95 % half width `paper_points_ci95`. `start_sd` and `paper_start_sd`: standard deviations over starts, with
    enough points and with the paper's. `outside`: share of the runs that an emulator fitted to all others misses by
    more than two of its deviations.
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
    """What the open inputs do to all `quantities` of one `defect`, from runs of the model at drawn inputs.

    `draws` runs were used, `failed` ones left out; `refined`: a second round of runs was needed. Draw by draw, `at` are
    the inputs, [draws, inputs], each as a share of its range, and `values` the quantities read, [draws, quantities],
    None where the run did not show one. `predicted`, [many, quantities], samples the joint distribution over inputs and
    starts. `spectrum`, [2, bins], is that of the scene with its own inputs, `spectra` those of the draws that show the
    line (see `spectrum_shape.halves_of`).
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

    def parts_ci95(self, name: str) -> dict[str, float]:
        """95 % half widths by inputs and by numerics, in the quantity's unit; none of a quantity not studied.

        That of the inputs holds a new draw with a chance of 95 %: by rank, since draws are not normal.
        """
        own = self.of(name)
        if own is None:
            return {}
        off = np.sort(np.abs(self.deviations([name])[:, 0]))
        return {INPUTS: float(off[min(math.ceil(0.95 * (off.size + 1)), off.size) - 1]), GRID: own.grid_ci95}

    def right_model_excess(self, snr: float, cells: float) -> NDArray[np.float64] | None:
        """`spectrum_shape.excess` of a right model whose inputs are not known [degrees], [draws, repeats].

        That is of the draws' spectra, each read in noise again and again, over the scene's own; `snr` and `cells` as in
        `spectrum_shape.with_noise`. None where no spectra are known.
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


def sensitivity_of(stored: Mapping[str, Any]) -> Sensitivity:
    """From plain values, as stored."""
    return Sensitivity(
        defects=tuple(
            DefectEffects(**one | {"quantities": tuple(QuantityEffects(**row) for row in one["quantities"])})
            for one in stored.get("defects", ())
        )
    )
