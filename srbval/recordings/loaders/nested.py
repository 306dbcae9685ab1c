"""Loaders for files of nested arrays: HDF5, MATLAB (v5, v7.3 and MATLAB objects) and Modelica results (MATLAB v4)."""

import math
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from srbval.errors import DataError
from srbval.recordings.raw import MIN_SAMPLES, ArrayOrText, RawFile, first_line
from srbval.recordings.times import is_time, stated_rate
from srbval.recordings.units import is_unit_key
from srbval.storage.hdf5_files import CHECKSUM, checked_summary
from srbval.storage.installation import pip_command

OBJECTS = "__function_workspace__"  # scipy's name for the contents of MATLAB's objects
TIMESERIES_SUFFIX = ".Data_"  # property of a `timeseries` with its samples
TRANSPOSED = "binTrans"  # layout of a Modelica result file; the other one is binNormal
_MODELICA_UNIT = re.compile(r".*\[([^\[\]|:]+)[^\[\]]*\]\s*", re.DOTALL)  # at the end of a description
MAX_CELLS = 64  # of one dataset of references
MATLAB_MARK, OBJECT_MARK = "MATLAB_class", "MATLAB_object_decode"  # attributes: of datasets, of objects
SKIPPED = ("#refs#", "#subsystem#")


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
            fields = {key: element[key] for key in value.dtype.names or ()}
            collect(variables, name if value.size == 1 else f"{name}({i})", fields or element)


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
    if any(isinstance(value, np.ndarray) and value.size >= MIN_SAMPLES for value in variables.values()):
        return (f"left out: MATLAB objects, {why}",) if why else ()
    raise DataError(
        f"{path}: its signals are MATLAB objects (timeseries, timetable or Dataset), "
        f"{why or f'and no signal of {MIN_SAMPLES} or more samples was found in them'}. A signal x can also be "
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
    matrices = {name: np.asarray(value).T if transposed else np.asarray(value) for name, value in contents.items()}
    names, places = _decode_rows(matrices["name"]), matrices["dataInfo"][:, :2].astype(int)
    described = _decode_rows(matrices["description"]) if "description" in contents else []
    columns: dict[tuple[int, int], NDArray[Any]] = {}
    variables: dict[str, ArrayOrText] = {}
    for name, (block, column) in zip(names, places.tolist(), strict=True):
        place = (block or 2, column)
        if place not in columns:
            values = np.ascontiguousarray(matrices[f"data_{place[0]}"][:, abs(column) - 1])
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


def load_hdf5(path: Path) -> RawFile:
    """Read numeric datasets, texts and root attributes; the names of groups are joined by dots.

    In MATLAB v7.3 a struct is a group, a cell array a dataset of references, a text an array of 16-bit codes. Arrays
    are transposed to MATLAB's shape. Arrays with missing samples or an unknown compression are in `RawFile.unusable`.
    """
    import h5py

    checked, marks = checked_summary(path) is not None, set[str]()
    found: dict[str, Any] = {key: {} for key in ("variables", "attributes", "unusable", "units", "rates_hz")}
    with h5py.File(path, "r") as file:
        _read_members("", file, found, marks)
    if CHECKSUM in found["attributes"] and not checked:
        raise DataError(f"{path}: no checksum at its end: cut off, or changed by another program. Copy it again.")
    notes = add_objects(path, found["variables"]) if OBJECT_MARK in marks else ()
    return RawFile(path=path, format="MATLAB v7.3" if MATLAB_MARK in marks else "", notes=notes, **found)


def _read_members(name: str, item: Any, found: dict[str, Any], marks: set[str]) -> None:
    """Add a dataset, or a group and its members, to `found`, and the names of the datasets' attributes to `marks`.

    `found` contains the fields of the `RawFile` to create. A stored data type is neither a dataset nor a group.
    `visititems` follows no soft and external links, which may leave the file, and visits each member once.
    """
    import h5py

    members, prefix = [(name, item)], f"{name}." if name else ""
    if isinstance(item, h5py.Group):
        item.visititems(lambda key, member: members.append((prefix + key.replace("/", "."), member)))
    for place, member in members:
        if isinstance(member, h5py.Dataset) and not place.startswith(SKIPPED):
            marks |= set(member.attrs)
            _read_dataset(place, member, found, marks)
        elif isinstance(member, h5py.Group) and not place.startswith(SKIPPED):
            found["attributes"] |= {f"{place}.{key}" if place else key: x for key, x in _attributes(member).items()}


def _read_dataset(name: str, dataset: Any, found: dict[str, Any], marks: set[str]) -> None:
    """Add a dataset of numbers, references or one text to `found`."""
    import h5py

    if dataset.shape is None or dataset.is_virtual or dataset.external:
        return
    dtype, size, is_matlab = dataset.dtype, math.prod(dataset.shape), MATLAB_MARK in dataset.attrs
    references, text = h5py.check_ref_dtype(dtype) is h5py.Reference, h5py.check_string_dtype(dtype) is not None
    if OBJECT_MARK in dataset.attrs or not (references or (text and size == 1) or dtype.kind in "fiub"):
        return
    attributes = _attributes(dataset)
    for key, value in attributes.items():
        if is_unit_key(key) and isinstance(value, str):
            found["units"].setdefault(name, value)
        elif stated := stated_rate(key, value):
            found["rates_hz"].setdefault(name, stated[0])
    values: ArrayOrText = ""
    if reason := _reason_unreadable(name, dataset, size):
        if dataset.is_scale:  # a dimension without values, as netCDF-4 writes it, is no variable
            return
        found["unusable"][name] = reason
        values = np.full(dataset.shape, np.nan, np.float16)
    elif references:
        held = [r for r in np.ravel(dataset[()]) if r][:MAX_CELLS]
        for i, reference in enumerate(held, 1):
            place = name if len(held) == 1 else f"{name}({i})"
            _read_members(place, dataset.file[reference], found, marks)
        return
    elif text:
        values = str(np.asarray(dataset.asstr()[()], object).item())
    elif attributes.get(MATLAB_MARK) == "char":
        values = "".join(map(chr, dataset[()].ravel()))
    else:
        values = np.zeros((0, 0)) if "MATLAB_empty" in dataset.attrs else np.asarray(dataset[()])
    found["variables"][name] = values.T if is_matlab and isinstance(values, np.ndarray) else values


def _attributes(item: Any) -> dict[str, float | str]:
    """Numbers and texts of the attributes with one element, by name; other attributes are not read."""
    import h5py

    values: dict[str, float | str] = {}
    for name in item.attrs:
        stored = item.attrs.get_id(name)
        text = h5py.check_string_dtype(stored.dtype) is not None
        if stored.shape is not None and math.prod(stored.shape) == 1 and (text or stored.dtype.kind in "fiu"):
            value = np.asarray(item.attrs[name], object).item()
            value = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
            values[name] = value if text else float(value)
    return values


def _reason_unreadable(name: str, dataset: Any, size: int) -> str | None:
    """Reason why a dataset of `size` samples cannot be read, such as an unknown compression; None if it can be."""
    import h5py

    settings = dataset.id.get_create_plist()
    filters = [settings.get_filter(i)[0] for i in range(settings.get_nfilters())]
    if missing := [code for code in filters if not h5py.h5z.filter_avail(code)]:
        return f"{name!r} is compressed by filter {missing[0]}, not installed. Decompress: h5repack -f NONE IN OUT"
    if size == 0:
        return None
    needed = math.prod(-(-n // chunk) for n, chunk in zip(dataset.shape, dataset.chunks or dataset.shape, strict=True))
    lost = needed - (dataset.id.get_num_chunks() if dataset.chunks else min(1, dataset.id.get_storage_size()))
    share = f"{lost} of {needed} chunks of {name!r} were never written ({100 * lost / needed:.3g} % of its samples)"
    return f"{share}; copy the file again, or record it again." if lost > 0 else None
