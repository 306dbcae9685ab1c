"""Loader for HDF5 files: MATLAB v7.3, runs and recordings of this program, and files of other programs."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.matlab import add_objects
from srbval.recordings.raw import ArrayOrText, RawFile, check_claim
from srbval.recordings.times import stated_rate
from srbval.recordings.units import is_unit_key
from srbval.storage.hdf5_files import CHECKSUM, checked_summary

MAX_GROUP_DEPTH = 12
MAX_ITEMS = 4096  # links of all groups, references followed, root attributes
MAX_CELLS = 64  # of one dataset of references
MAX_FILTERS = 6  # of a dataset; each may expand the output of the previous filter
MAX_TEXT = 65536  # characters; longer texts of codes are cut
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
        reader = _Hdf5Reader(path, file)
    if CHECKSUM in reader.found["attributes"] and not checked:
        raise DataError(f"{path}: no checksum at its end: cut off, or changed by another program. Copy it again.")
    notes = add_objects(path, reader.found["variables"]) if reader.has_objects else ()
    return RawFile(path=path, format="MATLAB v7.3" if reader.matlab else "", notes=notes, **reader.found)


class _Hdf5Reader:
    """Reader of an open HDF5 file; `found` contains the fields of the `RawFile` to create."""

    def __init__(self, path: Path, file: Any) -> None:
        self.path, self.file = path, file
        self.claimed = self.items = 0
        self.has_objects = False
        self.found: dict[str, Any] = {key: {} for key in ("variables", "attributes", "unusable", "units", "rates_hz")}
        members = self._members(file)
        self.matlab = any("MATLAB_class" in item.attrs for _, item in members)
        for name, item in members:
            self._visit(name, item, 1)
        self.found["attributes"] |= self._attributes(file)

    def _count(self, items: int) -> None:
        self.items += items
        if self.items > MAX_ITEMS:
            raise DataError(f"{self.path}: more than {MAX_ITEMS} links, references and attributes; not a recording.")

    def _attributes(self, item: Any) -> list[tuple[str, float | str]]:
        self._count(len(item.attrs))
        return [(name, value) for name in item.attrs if (value := self._attribute(item, name)) is not None]

    def _claim(self, count: int, what: str) -> None:
        self.claimed += count
        check_claim(self.path, self.claimed, what)

    def _members(self, group: Any) -> list[tuple[str, Any]]:
        """Names and members of an HDF5 group, without soft and external links (they may leave the file or loop)."""
        import h5py

        self._count(len(group))
        names = [name for name in group if name not in SKIPPED]
        return [(name, group[name]) for name in names if isinstance(group.get(name, getlink=True), h5py.HardLink)]

    def _visit(self, name: str, item: Any, depth: int) -> None:
        import h5py

        if depth > MAX_GROUP_DEPTH:
            raise DataError(f"{self.path}: nested deeper than {MAX_GROUP_DEPTH} groups or references; not a recording.")
        if isinstance(item, h5py.Group):
            self.found["attributes"] |= {f"{name}.{key}": value for key, value in self._attributes(item)}
            for key, member in self._members(item):
                self._visit(f"{name}.{key}", member, depth + 1)
        elif isinstance(item, h5py.Dataset) and not (item.shape is None or item.is_virtual or item.external):
            self._dataset(name, item, depth)

    def _dataset(self, name: str, dataset: Any, depth: int) -> None:
        """Add a dataset of numbers, references or one text to `found`; `depth` counts the levels above it."""
        import h5py

        dtype, size = dataset.dtype, math.prod(dataset.shape)
        references, text = h5py.check_ref_dtype(dtype) is h5py.Reference, h5py.check_string_dtype(dtype) is not None
        is_object = OBJECT_MARK in dataset.attrs
        self.has_objects |= is_object
        if is_object or not (references or (text and size == 1) or dtype.kind in "fiub"):
            return
        self._claim(size * dtype.itemsize, f"dataset {name!r}")
        check_claim(self.path, math.prod(dataset.chunks or ()) * dtype.itemsize, f"a chunk of dataset {name!r}")
        for key, value in self._attributes(dataset):
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
            self._count(len(held))
            for i, reference in enumerate(held, 1):
                self._visit(name if len(held) == 1 else f"{name}({i})", self.file[reference], depth + 1)
            return
        elif text:
            values = str(np.asarray(dataset.asstr()[()], object).item())
            self._claim(len(values), f"text {name!r}")
        elif "MATLAB_class" in dataset.attrs and self._attribute(dataset, "MATLAB_class") == "char":
            values = "".join(map(chr, dataset[()].ravel()[:MAX_TEXT]))
        else:
            values = np.zeros((0, 0)) if "MATLAB_empty" in dataset.attrs else np.asarray(dataset[()])
        self.found["variables"][name] = values.T if self.matlab and isinstance(values, np.ndarray) else values

    def _attribute(self, item: Any, name: str) -> float | str | None:
        """Number or text of an attribute with one element; other attributes are not read and return None."""
        import h5py

        stored = item.attrs.get_id(name)
        text = h5py.check_string_dtype(stored.dtype) is not None
        if stored.shape is None or math.prod(stored.shape) != 1 or not (text or stored.dtype.kind in "fiu"):
            return None
        self._claim(stored.dtype.itemsize, f"attribute {name!r}")
        value = np.asarray(item.attrs[name], object).item()
        if isinstance(value, bytes | str):
            value = value.decode("utf-8", "replace") if isinstance(value, bytes) else value
            self._claim(len(value), f"attribute {name!r}")
            return value
        return float(value)


def _reason_unreadable(name: str, dataset: Any, size: int) -> str | None:
    """Reason why a dataset of `size` samples cannot be read, such as an unknown compression; None if it can be."""
    import h5py

    settings = dataset.id.get_create_plist()
    filters = [settings.get_filter(i)[0] for i in range(settings.get_nfilters())]
    if len(filters) > MAX_FILTERS:
        return f"{name!r} is compressed by {len(filters)} filters; at most {MAX_FILTERS} are read; not a recording."
    if missing := [code for code in filters if not h5py.h5z.filter_avail(code)]:
        return f"{name!r} is compressed by filter {missing[0]}, not installed. Decompress: h5repack -f NONE IN OUT"
    if size == 0:
        return None
    needed = math.prod(-(-n // chunk) for n, chunk in zip(dataset.shape, dataset.chunks or dataset.shape, strict=True))
    lost = needed - (dataset.id.get_num_chunks() if dataset.chunks else min(1, dataset.id.get_storage_size()))
    share = f"{lost} of {needed} chunks of {name!r} were never written ({100 * lost / needed:.3g} % of its samples)"
    return f"{share}; copy the file again, or record it again." if lost > 0 else None
