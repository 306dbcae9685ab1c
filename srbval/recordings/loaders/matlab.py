"""Loaders for MATLAB v5 files, including MATLAB objects, and for Modelica result files (MATLAB v4 files)."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.raw import ArrayOrText, RawFile, first_line
from srbval.recordings.times import is_time
from srbval.storage.installation import pip_command

MIN_SIGNAL_SAMPLES = 256  # samples of a signal
OBJECTS = "__function_workspace__"  # scipy's name for the contents of MATLAB's objects
TIMESERIES_SUFFIX = ".Data_"  # property of a `timeseries` with its samples
TRANSPOSED = "binTrans"  # layout of a Modelica result file; the other one is binNormal
_MODELICA_UNIT = re.compile(r".*\[([^\[\]|:]+)[^\[\]]*\]\s*", re.DOTALL)  # at the end of a description


def load_matlab(path: Path) -> RawFile:
    """Read all numeric arrays and texts of a MATLAB v5 file, also in (nested) structs and in objects."""
    from scipy.io import loadmat

    variables: dict[str, ArrayOrText] = {}
    contents = loadmat(path)
    for name, value in contents.items():
        if not name.startswith("__"):  # fields by scipy, and unnamed contents by MATLAB
            collect(variables, name, value)
    notes = add_objects(path, variables) if OBJECTS in contents else ()
    return RawFile(path=path, variables=variables, notes=notes)


def collect(variables: dict[str, ArrayOrText], name: str, value: Any) -> None:
    """Add numbers and texts in `value` to `variables`, fields as ``name.field``."""
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if hasattr(value, "columns"):  # a table of pandas, with the times of a timetable as its index
        value = {"time": value.index.to_numpy()} | {str(key): value[key].to_numpy() for key in value.columns}
    value = getattr(value, "properties", value)  # of an object
    if isinstance(value, Mapping):
        for key, member in value.items():
            collect(variables, f"{name}.{key}", member)
    if not isinstance(value, np.ndarray) or isinstance(value, MatlabFunction | MatlabOpaque):
        return
    if value.dtype.kind in "mM" and value.size:
        value = (value - value.ravel()[0]) / np.timedelta64(1, "s")
    if value.dtype.kind in "UT":
        variables[name] = "".join(value.ravel(order="F")).strip()
    elif value.dtype.kind in "fiu":
        variables[name] = value
    elif value.dtype.kind in "OV":
        for i, element in enumerate(value.ravel(order="F"), 1):
            place = name if value.size == 1 else f"{name}({i})"
            for field in value.dtype.names or ("",):
                member = element[field] if field else element
                collect(variables, f"{place}.{field}" if field else place, member)


def add_objects(path: Path, variables: dict[str, ArrayOrText]) -> tuple[str, ...]:
    """Add MATLAB objects to `variables`, return notes on unread objects; `DataError` if no signal is found."""
    why = ""
    try:
        from matio import load_from_mat

        for name, value in load_from_mat(str(path)).items():
            collect(variables, name, value)
        _name_series(variables)
    except ImportError:
        why = f"which need the library mat-io ({pip_command('mat-io')})"
    except Exception as error:  # a damaged file may raise anything in a library
        why = f"which mat-io cannot read ({first_line(error)})"
    if any(isinstance(value, np.ndarray) and value.size >= MIN_SIGNAL_SAMPLES for value in variables.values()):
        return (f"left out: MATLAB objects, {why}",) if why else ()
    raise DataError(
        f"{path}: its signals are MATLAB objects (timeseries, timetable or Dataset), "
        f"{why or f'and no signal of {MIN_SIGNAL_SAMPLES} or more samples was found in them'}. A signal x can also be "
        "exported from MATLAB as a CSV table: writetable(timeseries2timetable(x), 'x.csv')"
    )


def _name_series(variables: dict[str, ArrayOrText]) -> None:
    """Replace each MATLAB `timeseries` by its samples and times; times not stored follow from start and increment."""
    for name in [name for name in variables if name.endswith(TIMESERIES_SUFFIX)]:
        owner, samples = name.removesuffix(TIMESERIES_SUFFIX), variables[name]
        count, info = max(np.shape(samples), default=0), f"{owner}.TimeInfo"
        start, step, units = (variables.get(f"{info}.{key}") for key in ("Start_", "Increment_", "Units"))
        stored = (variables.get(f"{place}.Time_") for place in (info, owner))
        times = next((one for one in stored if isinstance(one, np.ndarray) and one.size == count), None)
        if times is None and isinstance(start, np.ndarray) and isinstance(step, np.ndarray):
            times = start.ravel()[:1] + step.ravel()[:1] * np.arange(count)
        if times is not None and times.size == count:
            variables[owner], variables[f"{owner}.time [{units or 's'}]"] = variables.pop(name), times


def load_modelica(path: Path) -> RawFile:
    """Read the variables of a Modelica result file; constants become single numbers, aliases share an array.

    Dymola and OpenModelica use the same layout: `name`, `description`, `dataInfo` (matrix and column of each
    variable, negative if the sign is changed) and the matrices `data_1`, `data_2`.
    """
    from scipy.io import loadmat

    contents = loadmat(path, chars_as_strings=False)
    transposed = TRANSPOSED in _decode_rows(contents["Aclass"])

    def matrix(name: str) -> NDArray[Any]:
        return np.asarray(contents[name]).T if transposed else np.asarray(contents[name])

    names, places = _decode_rows(matrix("name")), matrix("dataInfo")[:, :2].astype(int)
    described = _decode_rows(matrix("description")) if "description" in contents else []
    columns: dict[tuple[int, int], NDArray[Any]] = {}
    variables: dict[str, ArrayOrText] = {}
    for name, (block, column) in zip(names, places.tolist(), strict=True):
        place = (block or 2, column)
        if place not in columns:
            values = np.ascontiguousarray(matrix(f"data_{place[0]}")[:, abs(column) - 1])
            columns[place] = (values if column > 0 else -values)[: 1 if block == 1 else None]
        if not variables or not is_time(name):  # the first variable is the time
            variables[name] = columns[place]
    units = map(_MODELICA_UNIT.fullmatch, described)
    return RawFile(
        path=path,
        variables=variables,
        attributes={"origin": "simulated"},
        units={name: unit[1] for name, unit in zip(names, units, strict=False) if unit},
    )


def _decode_rows(letters: NDArray[Any]) -> list[str]:
    """Decode a matrix of characters in UTF-8, one text per row."""
    return ["".join(row).encode("latin-1").decode("utf-8", "replace").strip("\0 ") for row in letters]
