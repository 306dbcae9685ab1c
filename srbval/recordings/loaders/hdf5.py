"""Loader for HDF5 files: MATLAB v7.3, runs and recordings of this program, and files of other programs."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.matlab import add_objects
from srbval.recordings.raw import ArrayOrText, RawFile
from srbval.recordings.times import stated_rate
from srbval.recordings.units import is_unit_key
from srbval.storage.hdf5_files import CHECKSUM, checked_summary

MAX_CELLS = 64  # of one dataset of references
OBJECT_MARK = "MATLAB_object_decode"  # attribute of the references of an object
SKIPPED = ("#refs#", "#subsystem#")


def load_hdf5(path: Path) -> RawFile:
    """Read numeric datasets, texts and root attributes; the names of groups are joined by dots.

    In MATLAB v7.3 a struct is a group, a cell array a dataset of references, a text an array of 16-bit codes. Arrays
    are transposed to MATLAB's shape. Arrays with missing samples or an unknown compression are in `RawFile.unusable`.
    """
    import h5py

    checked = checked_summary(path) is not None
    with h5py.File(path, "r") as file:
        reader = _Hdf5Reader(h5py, file)
    if CHECKSUM in reader.found["attributes"] and not checked:
        raise DataError(f"{path}: no checksum at its end: cut off, or changed by another program. Copy it again.")
    notes = add_objects(path, reader.found["variables"]) if reader.has_objects else ()
    return RawFile(path=path, format="MATLAB v7.3" if reader.matlab else "", notes=notes, **reader.found)


class _Hdf5Reader:
    """Reader of an open HDF5 file by the module `h5py`; `found` contains the fields of the `RawFile` to create."""

    def __init__(self, h5py: Any, file: Any) -> None:
        self.h5py, self.file = h5py, file
        self.has_objects = self.matlab = False
        self.found: dict[str, Any] = {key: {} for key in ("variables", "attributes", "unusable", "units", "rates_hz")}
        self._read("", file)

    def _read(self, name: str, item: Any) -> None:
        """Add a dataset, or a group and its members, to `found`.

        `visititems` follows no soft and external links, which may leave the file, and visits each member once.
        """
        if isinstance(item, self.h5py.Group):
            item.visititems(lambda key, member: self._add(_join(name, key.replace("/", ".")), member))
        self._add(name, item)

    def _add(self, name: str, item: Any) -> None:
        """Add a dataset, or the attributes of a group, to `found`; a stored data type is neither."""
        if isinstance(item, self.h5py.Dataset) and not name.startswith(SKIPPED):
            self._read_dataset(name, item)
        elif isinstance(item, self.h5py.Group) and not name.startswith(SKIPPED):
            self.found["attributes"] |= {_join(name, key): value for key, value in _attributes(item)}

    def _read_dataset(self, name: str, dataset: Any) -> None:
        """Add a dataset of numbers, references or one text to `found`."""
        h5py = self.h5py
        if dataset.shape is None or dataset.is_virtual or dataset.external:
            return
        dtype, size, is_matlab = dataset.dtype, math.prod(dataset.shape), "MATLAB_class" in dataset.attrs
        references, text = h5py.check_ref_dtype(dtype) is h5py.Reference, h5py.check_string_dtype(dtype) is not None
        is_object = OBJECT_MARK in dataset.attrs
        self.has_objects |= is_object
        self.matlab |= is_matlab
        if is_object or not (references or (text and size == 1) or dtype.kind in "fiub"):
            return
        for key, value in _attributes(dataset):
            if is_unit_key(key) and isinstance(value, str):
                self.found["units"].setdefault(name, value)
            elif stated := stated_rate(key, value):
                self.found["rates_hz"].setdefault(name, stated[0])
        values: ArrayOrText = ""
        if reason := _reason_unreadable(name, dataset, size):
            if dataset.is_scale:  # a dimension without values, as netCDF-4 writes it, is no variable
                return
            self.found["unusable"][name] = reason
            values = np.full(dataset.shape, np.nan, np.float16)
        elif references:
            held = [r for r in np.ravel(dataset[()]) if r][:MAX_CELLS]
            for i, reference in enumerate(held, 1):
                self._read(name if len(held) == 1 else f"{name}({i})", self.file[reference])
            return
        elif text:
            values = str(np.asarray(dataset.asstr()[()], object).item())
        elif is_matlab and _attribute(dataset, "MATLAB_class") == "char":
            values = "".join(map(chr, dataset[()].ravel()))
        else:
            values = np.zeros((0, 0)) if "MATLAB_empty" in dataset.attrs else np.asarray(dataset[()])
        self.found["variables"][name] = values.T if is_matlab and isinstance(values, np.ndarray) else values


def _join(*names: str) -> str:
    return ".".join(filter(None, names))


def _attributes(item: Any) -> list[tuple[str, float | str]]:
    return [(name, value) for name in item.attrs if (value := _attribute(item, name)) is not None]


def _attribute(item: Any, name: str) -> float | str | None:
    """Number or text of an attribute with one element; other attributes are not read and return None."""
    import h5py

    stored = item.attrs.get_id(name)
    text = h5py.check_string_dtype(stored.dtype) is not None
    if stored.shape is None or math.prod(stored.shape) != 1 or not (text or stored.dtype.kind in "fiu"):
        return None
    value = np.asarray(item.attrs[name], object).item()
    if isinstance(value, bytes | str):
        return value.decode("utf-8", "replace") if isinstance(value, bytes) else value
    return float(value)


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
