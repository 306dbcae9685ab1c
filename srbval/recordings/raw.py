"""Result of a loader: the named arrays and texts of a file, before anybody interprets them; and the loader's limits."""

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
MAX_CODES = 64
LARGEST_SAMPLE = 1e100  # above any vibration sample; its square and its spectrum must not overflow
LONGEST_NAME = 80
LONGEST_ERROR = 120  # characters quoted of another library's error message
EXPANSION = 2  # times the file's own size: measured noise hardly compresses
LONG_SAMPLES = 2**22  # longer signals are kept in single precision, and looked at in blocks of so many samples
FREE_BYTES = 128 * 2**20  # small files may expand to this much in any case


@dataclass(frozen=True, kw_only=True, eq=False)
class RawFile:
    """Numeric arrays and texts of a file under their own names; fields of nested structs are joined by dots.

    `attributes` belong to the whole file, `units` and `rates_hz` to single variables; `notes` and `cautions` are the
    loader's. With `full_scale` the samples are shares of a full scale that the file does not state. `unusable` gives
    the reason for variables without samples in the file; they are NaN, and a `DataError` if used.
    """

    path: Path
    format: str
    variables: Mapping[str, ArrayOrText]
    attributes: Mapping[str, float | str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    rates_hz: Mapping[str, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    cautions: tuple[str, ...] = ()
    full_scale: bool = False
    unusable: Mapping[str, str] = field(default_factory=dict)

    def _value(self, name: str) -> ArrayOrText | float | None:
        """The variable or attribute called `name`, if there is none that of another case."""
        held = {**self.attributes, **self.variables}
        return held[name] if name in held else {key.lower(): value for key, value in held.items()}.get(name.lower())

    def check_usable(self, name: str) -> None:
        """Refuse (`DataError`) a variable that is `unusable`."""
        if name in self.unusable:
            raise DataError(f"{self.path}: {self.unusable[name]}")

    def array(self, name: str) -> NDArray[Any] | None:
        """The numeric array called `name`, or None; of one that is `unusable` the shape alone means something."""
        value = self.variables.get(name)
        return value if isinstance(value, np.ndarray) else None

    def number(self, name: str) -> float | None:
        """The scalar called `name` (a one-element array, or a text that is a number), or None."""
        self.check_usable(name)
        value = self._value(name)
        if isinstance(value, np.ndarray):
            value = value.flat[0].item() if value.size == 1 else None
        try:
            number = float(value) if isinstance(value, int | float | str) else math.nan
        except ValueError:
            return None
        return number if math.isfinite(number) else None

    def text(self, name: str) -> str | None:
        """The text called `name`, or None; a short array of 16-bit codes (MATLAB v7.3) is read as one."""
        self.check_usable(name)
        value = self._value(name)
        if isinstance(value, np.ndarray) and value.dtype == np.uint16 and 0 < value.size <= MAX_CODES:
            return "".join(chr(code) for code in value.ravel(order="F"))
        return value if isinstance(value, str) else None

    def signal(self, name: str) -> NDArray[np.float64]:
        """The array called `name` as samples, see `as_signal`."""
        self.check_usable(name)
        return as_signal(self.variables[name], f"{self.path}: {name}")


def as_signal(values: ArrayOrText, what: str) -> NDArray[np.float64]:
    """Samples as a contiguous vector, [n]; NaN, infinite, absurdly large and complex values are refused.

    It is float64, or float32 from `LONG_SAMPLES` on: then a mapped file of single precision is used where it is.
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
    """Place of the first sample, and samples, of each block of at most `LONG_SAMPLES`."""
    for first in range(0, samples.size, LONG_SAMPLES):
        yield first, samples[first : first + LONG_SAMPLES]


def orient_samples(values: NDArray[Any]) -> NDArray[Any]:
    """A vector or matrix with the samples down and the channels across, shape [n, channels]."""
    matrix = values.reshape(len(values), -1) if values.ndim != 2 else values
    return matrix if matrix.shape[0] >= matrix.shape[1] else matrix.T


def printable(text: str, longest: int = LONGEST_NAME) -> str:
    """One line of a text out of a file, without control characters, cut after `longest`; markup is not escaped."""
    shown = "".join(c if c.isprintable() else "?" for c in text[: longest + 1])
    return shown if len(shown) <= longest else shown[: longest - 1] + "…"


def first_line(error: Exception, longest: int = LONGEST_ERROR) -> str:
    """First line of another library's error message, or the name of the error."""
    return str(error).split("\n", 1)[0][:longest] or type(error).__name__


def memory_limit_bytes(path: Path, expansion: int = EXPANSION) -> int:
    """The most memory that the contents of this file may take [bytes]: a few bytes can claim terabytes."""
    return expansion * path.stat().st_size + FREE_BYTES


def check_claim(path: Path, claimed_bytes: int, what: str, expansion: int = EXPANSION) -> None:
    """Refuse (`DataError`) an array whose claimed size is out of proportion to the file."""
    limit = memory_limit_bytes(path, expansion)
    if claimed_bytes > limit:
        raise DataError(
            f"{path}: {what} claims {claimed_bytes} bytes in a file of {path.stat().st_size}; the limit is "
            f"{limit}. The file is damaged or not a recording."
        )
