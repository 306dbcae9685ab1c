"""Measured frequency responses, acceleration over force: tables of text, or UFF dataset 58."""

import csv
import io
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.loaders.signals import UFF
from srbval.recordings.raw import RawFile
from srbval.storage.files import read_limited

COLUMNS = ("frequency_hz", "real_m_s2_n", "imag_m_s2_n")
MOST_BYTES = 2**26
FRF, ACCELERATION, FORCE = 4, 12, 13  # function and data types of dataset 58


def read_frf(path: Path) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Frequencies [Hz], rising, and the response [m/s2/N], complex; `DataError` for anything else."""
    content = read_limited(path, MOST_BYTES)
    if UFF.matches(content):
        raw = replace(UFF, read=load_response).load(path).variables
        frequency_hz, values = np.asarray(raw["frequency_hz"], np.float64), np.asarray(raw["response"], np.complex128)
    else:
        frequency_hz, values = _table(path, content)
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


def load_response(path: Path) -> RawFile:
    """Read the one frequency response of a universal file: ``frequency_hz`` and ``response``, complex, as stored."""
    import pyuff

    sets = pyuff.UFF(str(path)).read_sets()
    found = [one for one in (sets if isinstance(sets, list) else [sets]) if one.get("type") == 58]
    responses = [one for one in found if one["func_type"] == FRF]
    kinds = [(one["ordinate_spec_data_type"], one["orddenom_spec_data_type"]) for one in responses]
    if len(responses) != 1 or kinds[0] != (ACCELERATION, FORCE):
        raise DataError(
            f"{path}: {len(responses)} frequency responses of {len(found)} datasets 58, of types {kinds}: exactly one, "
            f"of acceleration over force, ({ACCELERATION}, {FORCE}), is needed. Export that one alone."
        )
    values = {"frequency_hz": responses[0]["x"], "response": responses[0]["data"]}
    return RawFile(path=path, format=UFF.name, variables={name: np.asarray(value) for name, value in values.items()})
