"""What a loader hands on: the named arrays and texts of a file, before anybody says what they mean."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError

Value = NDArray[Any] | str
MAX_CODES = 64
LARGEST = 1e100  # no vibration sample is; its square and its spectrum must not overflow


@dataclass(frozen=True, kw_only=True, eq=False)
class RawFile:
    """Variables of a file under their own names; fields of nested structs are joined by dots.

    `variables` holds numeric arrays (any shape, as stored) and texts; `attributes` the root attributes
    of an HDF5 file or the ``# key = value`` lines of a text file. Nothing in it is interpreted.
    """

    path: Path
    format: str
    variables: Mapping[str, Value]
    attributes: Mapping[str, float | str] = field(default_factory=dict)

    def array(self, name: str) -> NDArray[Any] | None:
        """The numeric array called `name`, or None."""
        value = self.variables.get(name)
        return value if isinstance(value, np.ndarray) else None

    def number(self, name: str) -> float | None:
        """The scalar called `name` (a one-element array, or a text that is a number), or None."""
        value = self.variables.get(name, self.attributes.get(name))
        if isinstance(value, np.ndarray):
            value = value.flat[0].item() if value.size == 1 else None
        try:
            number = float(value) if isinstance(value, int | float | str) else math.nan
        except ValueError:
            return None
        return number if math.isfinite(number) else None

    def text(self, name: str) -> str | None:
        """The text called `name`, or None; a short array of 16-bit codes (MATLAB v7.3) is read as one."""
        value = self.variables.get(name, self.attributes.get(name))
        if isinstance(value, np.ndarray) and value.dtype == np.uint16 and 0 < value.size <= MAX_CODES:
            return "".join(chr(code) for code in value.ravel(order="F"))
        return value if isinstance(value, str) else None


def as_signal(values: NDArray[Any], what: str) -> NDArray[np.float64]:
    """Samples as a contiguous float64 vector, shape [n], a read-only view where they are stored so.

    NaN, infinity, absurdly large and complex values are refused.
    """
    if values.dtype.kind not in "fiu":
        raise DataError(f"{what}: {values.dtype} values are not a vibration signal; real numbers are needed.")
    if values.size and not _fit_to_square(values):
        wrong = ~(np.abs(values.ravel()) < LARGEST)
        bad = int(np.flatnonzero(wrong)[0])
        raise DataError(
            f"{what}: sample {bad} of {values.size} is {values.ravel()[bad]}; every sample must be finite and below "
            f"{LARGEST:g}. Export the record again, or cut the damaged part off."
        )
    return np.ascontiguousarray(values, dtype=np.float64).ravel()


def _fit_to_square(values: NDArray[Any]) -> bool:
    """Whether every sample is finite and its square no overflow; NaN makes either comparison false."""
    if values.dtype.kind != "f":
        return True
    with np.errstate(invalid="ignore"):
        return float(values.min()) > -LARGEST and float(values.max()) < LARGEST
