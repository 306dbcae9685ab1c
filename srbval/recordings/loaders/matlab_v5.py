"""MATLAB v5 to v7 files, by scipy.io.loadmat, behind a check of every size the file claims."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.loaders.matlab_v5_guard import check_structure
from srbval.recordings.raw import RawFile, Value

MAX_DEPTH = 12
MAX_ELEMENTS = 64  # of a cell or struct array; recordings use one


def load_matlab_v5(path: Path) -> RawFile:
    """Read every numeric array, text and (nested) struct field of a MATLAB v5 file.

    Cells and structs wrapped in 1 x 1 object arrays are unwrapped, as scipy hands them out. Function
    handles, Java objects and sparse arrays are left out. Raises `DataError` whatever the damage.
    """
    check_structure(path)
    variables: dict[str, Value] = {}
    for name, value in _loadmat(path).items():
        if not name.startswith("__"):
            _flatten(name, value, variables, 0)
    return RawFile(path=path, format="MATLAB v5", variables=variables)


def _loadmat(path: Path) -> dict[str, Any]:
    from scipy.io import loadmat

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # duplicate names and odd headers: what counts is what is read
            return loadmat(str(path), appendmat=False, verify_compressed_data_integrity=True)
    except Exception as error:  # the one border where a hostile file meets foreign code
        text = str(error).split("\n", 1)[0][:120] or type(error).__name__
        raise DataError(f"{path}: truncated or damaged MATLAB v5 file ({text}). Copy it again.") from None


def _flatten(name: str, value: Any, into: dict[str, Value], depth: int) -> None:
    if depth > MAX_DEPTH or not isinstance(value, np.ndarray):
        return
    if value.dtype.names is not None:
        for index, record in _elements(value):
            for key in value.dtype.names:
                _flatten(f"{name}{index}.{key}", record[key], into, depth + 1)
    elif value.dtype == object:
        for index, element in _elements(value):
            _flatten(f"{name}{index}", element, into, depth + 1)
    elif value.dtype.kind == "U":
        into[name] = "".join(str(part) for part in value.ravel()).strip()
    elif value.dtype.kind in "fiub":
        into[name] = value


def _elements(array: NDArray[Any]) -> list[tuple[str, Any]]:
    """The elements of a cell or struct array; a single one has no index in its name."""
    flat = array.ravel()
    if flat.size == 1:
        return [("", flat[0])]
    return [(f"({i + 1})", element) for i, element in enumerate(flat[:MAX_ELEMENTS])]
