"""Measured frequency responses, acceleration over force: tables of text, or UFF dataset 58."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.errors import DataError
from srbval.recordings.loaders import detect_format
from srbval.recordings.loaders.signals import UFF
from srbval.recordings.raw import RawFile

COLUMNS = ("frequency_hz", "real_m_s2_n", "imag_m_s2_n")
FRF, ACCELERATION, FORCE = 4, 12, 13  # function and data types of dataset 58


def read_frf(path: Path) -> tuple[FloatArray, NDArray[np.complex128]]:
    """Frequencies [Hz], rising, and the response [m/s2/N], complex; `DataError` for anything else."""
    kind = detect_format(path)
    columns = (replace(UFF, read=load_response) if kind is UFF else kind).load(path).variables
    if tuple(columns) != COLUMNS:
        raise DataError(f"{path}: columns must be {', '.join(COLUMNS)}; found {', '.join(columns)[:200]}.")
    frequency_hz, real, imaginary = (np.asarray(column, np.float64) for column in columns.values())
    values = real + 1j * imaginary
    if frequency_hz.size < 2 or not (np.isfinite(frequency_hz).all() and np.isfinite(values).all()):
        raise DataError(f"{path}: {frequency_hz.size} lines of a response; two or more finite ones are needed.")
    if not (np.diff(frequency_hz) > 0).all() or frequency_hz[0] < 0:
        place = int(np.argmin(np.diff(frequency_hz)))
        raise DataError(f"{path}: frequencies must rise from 0 Hz or above; {frequency_hz[place]:g} Hz does not.")
    return frequency_hz, values


def load_response(path: Path) -> RawFile:
    """Read the one frequency response of a universal file into `COLUMNS`."""
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
    response = np.asarray(responses[0]["data"])
    values = np.asarray(responses[0]["x"]), response.real, response.imag
    return RawFile(path=path, format=UFF.name, variables=dict(zip(COLUMNS, values, strict=True)))
