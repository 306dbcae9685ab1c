"""Measured frequency responses, acceleration over force: tables of text, or UFF dataset 58."""

import csv
import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.storage.files import read_limited

COLUMNS = ("frequency_hz", "real_m_s2_n", "imag_m_s2_n")
MOST_BYTES = 2**26
FRF, ACCELERATION, FORCE = 4, 12, 13  # function and data types of dataset 58
UFF_MARK = b"    -1"


def read_frf(path: Path) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Frequencies [Hz], rising, and the response [m/s2/N], complex; `DataError` for anything else."""
    content = read_limited(path, MOST_BYTES)
    frequency_hz, values = _uff(path) if content.startswith(UFF_MARK) else _table(path, content)
    if frequency_hz.size < 2 or not (np.isfinite(frequency_hz).all() and np.isfinite(values).all()):
        raise DataError(f"{path}: {frequency_hz.size} lines of a response; two or more finite ones are needed.")
    if not (np.diff(frequency_hz) > 0).all() or frequency_hz[0] < 0:
        place = int(np.argmin(np.diff(frequency_hz)))
        raise DataError(f"{path}: frequencies must rise from 0 Hz or above; {frequency_hz[place]:g} Hz does not.")
    return frequency_hz, values


def _table(path: Path, content: bytes) -> tuple[FloatArray, NDArray[np.complex128]]:
    try:
        rows = list(csv.reader(io.StringIO(content.decode("utf-8-sig"))))
        header = tuple(name.strip() for name in rows[0])
        table = np.array([[float(cell) for cell in row] for row in rows[1:] if row])
    except (UnicodeDecodeError, ValueError, IndexError, csv.Error) as error:
        raise DataError(f"{path}: not a table of numbers under a header: {error}.") from None
    if header != COLUMNS or table.shape[1:] != (3,):
        raise DataError(f"{path}: columns must be {', '.join(COLUMNS)}; found {', '.join(header)[:200]}.")
    return table[:, 0], table[:, 1] + 1j * table[:, 2]


def _uff(path: Path) -> tuple[FloatArray, NDArray[np.complex128]]:
    try:
        import pyuff
    except ImportError:
        raise DataError(f'{path}: UFF needs pyuff: pip install "srbval[formats]".') from None
    try:
        sets = pyuff.UFF(str(path)).read_sets()
        found = [one for one in (sets if isinstance(sets, list) else [sets]) if one.get("type") == 58]
        responses = [one for one in found if one["func_type"] == FRF]
        kinds = [(one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]) for one in responses]
    except Exception as error:  # whatever pyuff raises of a damaged file
        raise DataError(f"{path}: cannot be read as UFF: {type(error).__name__}: {error}.") from None
    if len(responses) != 1 or kinds[0] != (ACCELERATION, FORCE):
        raise DataError(
            f"{path}: {len(responses)} frequency responses of {len(found)} datasets 58, of types {kinds}: exactly one, "
            f"of acceleration over force, ({ACCELERATION}, {FORCE}), is needed. Export that one alone."
        )
    return np.asarray(responses[0]["x"], dtype=np.float64), np.asarray(responses[0]["data"], dtype=np.complex128)
