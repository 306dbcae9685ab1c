"""`RawFile`, the arrays and texts of a file before they are interpreted, and checked samples."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError

ArrayOrText = NDArray[Any] | str
TEXT = "text"  # format of text tables
MIN_SAMPLES = 256  # of a signal
MAX_CODES = 64
LARGEST_SAMPLE = 1e100  # above any vibration sample; neither squares nor spectra may overflow
LONGEST_NAME = 80
LONGEST_ERROR = 120  # characters quoted of another library's error message
LONG_SAMPLES = 2**22  # from which a signal is kept in single precision; also the length of a block


@dataclass(frozen=True, kw_only=True, eq=False)
class RawFile:
    """Numeric arrays and texts of a file by name; the names of nested structs are joined by dots.

    `format` is the name of the `FileFormat`, unless the loader sets another. `attributes` belong to the whole file,
    `units` and `rates_hz` to single variables. `notes` and `cautions` come from the loader. With `full_scale` the
    samples are fractions of a full scale that the file does not state. `unusable` maps a variable without readable
    samples to the reason; its values are NaN, and using them raises `DataError`.
    """

    path: Path
    variables: Mapping[str, ArrayOrText]
    format: str = ""
    attributes: Mapping[str, float | str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    rates_hz: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    full_scale: bool = False
    unusable: Mapping[str, str] = field(default_factory=dict)

    def _value(self, name: str) -> ArrayOrText | float | None:
        """Usable variable or attribute called `name`; if none has this name, the case of letters is ignored."""
        self.check_usable(name)
        held = {**self.attributes, **self.variables}
        return held[name] if name in held else {key.lower(): value for key, value in held.items()}.get(name.lower())

    def check_usable(self, name: str) -> None:
        """Raise `DataError` if samples of the variable cannot be read (`unusable`)."""
        if name in self.unusable:
            raise DataError(f"{self.path}: {self.unusable[name]}")

    @property
    def arrays(self) -> dict[str, NDArray[Any]]:
        """Numeric arrays by name; only the shape of an `unusable` array is meaningful."""
        return {name: value for name, value in self.variables.items() if isinstance(value, np.ndarray)}

    def number(self, name: str) -> float | None:
        """Finite number called `name` (an array of one element, or a text that is a number), or None."""
        value = self._value(name)
        if isinstance(value, np.ndarray):
            value = value.flat[0].item() if value.size == 1 else None
        try:
            number = float(value) if isinstance(value, int | float | str) else math.nan
        except ValueError:
            return None
        return number if math.isfinite(number) else None

    def text(self, name: str) -> str | None:
        """Text called `name`, or None; a short array of 16-bit codes (MATLAB v7.3) is decoded."""
        value = self._value(name)
        if isinstance(value, np.ndarray) and value.dtype == np.uint16 and 0 < value.size <= MAX_CODES:
            return "".join(chr(code) for code in value.ravel(order="F"))
        return value if isinstance(value, str) else None

    def signal(self, name: str) -> NDArray[np.float64]:
        """Array called `name` as a vector of checked samples, see `as_signal`."""
        self.check_usable(name)
        return as_signal(self.variables[name], f"{self.path}: {name}")


def as_signal(values: ArrayOrText, what: str) -> NDArray[np.float64]:
    """Convert values to a contiguous vector of samples [n]; `what` names them in error messages.

    The vector is float64, or float32 if it has at least `LONG_SAMPLES` samples, so that a memory-mapped file of single
    precision is not copied. Raises `DataError` for texts, complex numbers, and samples that are NaN, infinite or too
    large.
    """
    if isinstance(values, str) or values.dtype.kind not in "fiu":
        kind = "text" if isinstance(values, str) else values.dtype
        raise DataError(f"{what}: {kind} values are not a vibration signal; real numbers are needed.")
    is_long = values.size >= LONG_SAMPLES
    largest = float(np.finfo(np.float32).max) if is_long else LARGEST_SAMPLE
    with np.errstate(invalid="ignore", over="ignore"):  # of NaN, of numbers too large for single precision
        samples = np.ascontiguousarray(values, dtype=np.float32 if is_long else np.float64).ravel()
        for first, block in blocks_of(samples):
            wrong = np.flatnonzero(~(np.abs(block) < largest))
            if wrong.size:
                at = first + int(wrong[0])
                raise DataError(
                    f"{what}: sample {at} of {values.size} is {values.ravel()[at]}; every sample must be finite "
                    f"and below {largest:.3g}. Export the record again, or cut the damaged part off."
                )
    return cast(NDArray[np.float64], samples)


def blocks_of(samples: NDArray[Any]) -> Iterator[tuple[int, NDArray[Any]]]:
    """Yield each block of at most `LONG_SAMPLES` samples with the index of its first sample."""
    for first in range(0, samples.size, LONG_SAMPLES):
        yield first, samples[first : first + LONG_SAMPLES]


def orient_samples(values: NDArray[Any]) -> NDArray[Any]:
    """Reshape an array to [n, channels]; the longer side of a matrix is taken as the samples."""
    matrix = values.reshape(len(values), -1) if values.ndim != 2 else values
    return matrix if matrix.shape[0] >= matrix.shape[1] else matrix.T


def printable(text: str, longest: int = LONGEST_NAME) -> str:
    """First `longest` characters of a text, with ``?`` for control characters and line ends; HTML is not escaped."""
    shown = "".join(c if c.isprintable() else "?" for c in text[: longest + 1])
    return shown if len(shown) <= longest else shown[: longest - 1] + "…"


def first_line(error: Exception, longest: int = LONGEST_ERROR) -> str:
    """First line of another library's error message; the name of the error's class if the message is empty."""
    return str(error).split("\n", 1)[0][:longest] or type(error).__name__
