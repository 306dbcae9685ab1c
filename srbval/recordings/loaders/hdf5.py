"""HDF5 files: MATLAB v7.3, this program's runs and stand-ins, and plain ones."""

from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.raw import FileFormat, RawFile, Value, check_claim, first_line

MAX_DEPTH = 12
MAX_DATASETS = 4096
SKIPPED = ("#refs#", "#subsystem#")
SIGNATURE = b"\x89HDF\r\n\x1a\n"
SIGNATURE_OFFSETS = (0, 512, 1024, 2048)  # after a user block of one of these sizes


def load_hdf5(path: Path) -> RawFile:
    """Read numeric datasets, texts and root attributes; groups are joined by dots, as MATLAB structs are.

    A MATLAB v7.3 struct is a group, a cell a dataset of references, a text an array of 16-bit codes;
    arrays are transposed back to MATLAB's own shape. Raises `DataError` whatever the damage.
    """
    import h5py

    reader = _Hdf5Reader(path)
    try:
        with h5py.File(path, "r") as file:
            reader.file = file
            reader.matlab = any("MATLAB_class" in item.attrs for _, item in _named_members(file))
            reader.visit("", file, 0)
            attributes = {key: _plain(value) for key, value in file.attrs.items()}
    except DataError:
        raise
    except Exception as error:  # the one border where a hostile file meets foreign code
        raise DataError(f"{path}: truncated or damaged HDF5 file ({first_line(error)}). Copy it again.") from None
    known = {key: value for key, value in attributes.items() if value is not None}
    kind = "MATLAB v7.3" if reader.matlab else FORMAT.name
    return RawFile(path=path, format=kind, variables=reader.variables, attributes=known)


class _Hdf5Reader:
    """Walks an open HDF5 file and collects `variables` under dotted names."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.file: Any = None
        self.matlab = False
        self.claimed = 0
        self.visited = 0
        self.variables: dict[str, Value] = {}

    def visit(self, name: str, item: Any, depth: int) -> None:
        import h5py

        self.visited += 1
        if depth > MAX_DEPTH or self.visited > MAX_DATASETS:
            raise DataError(f"{self.path}: nested deeper than {MAX_DEPTH} or more than {MAX_DATASETS} items.")
        if isinstance(item, h5py.Group):
            for key, member in _named_members(item):
                if key not in SKIPPED:
                    self.visit(f"{name}.{key}" if name else key, member, depth + 1)
        elif isinstance(item, h5py.Dataset):
            self._dataset(name, item, depth)

    def _dataset(self, name: str, dataset: Any, depth: int) -> None:
        import h5py

        if dataset.shape is None or dataset.is_virtual or dataset.external:
            return
        self.claimed += dataset.size * dataset.dtype.itemsize
        check_claim(self.path, self.claimed, f"dataset {name!r}")
        if h5py.check_ref_dtype(dataset.dtype) is not None:
            self._references(name, dataset, depth)
        elif h5py.check_string_dtype(dataset.dtype) is not None:
            if dataset.size == 1:
                self.variables[name] = str(_plain(dataset.asstr()[()]))
        elif dataset.dtype.kind in "fiub":
            self.variables[name] = self._values(dataset)

    def _references(self, name: str, dataset: Any, depth: int) -> None:
        references = [r for r in np.ravel(dataset[()]) if r]
        for i, reference in enumerate(references[:64]):
            index = "" if len(references) == 1 else f"({i + 1})"
            self.visit(f"{name}{index}", self.file[reference], depth + 1)

    def _values(self, dataset: Any) -> Value:
        matlab_class = dataset.attrs.get("MATLAB_class", b"")
        if matlab_class == b"char":
            return "".join(chr(code) for code in np.ravel(dataset[()].T, order="F"))
        if "MATLAB_empty" in dataset.attrs:
            return np.zeros((0, 0))
        values = dataset[()]
        return np.asarray(values).T if self.matlab else np.asarray(values)


def _named_members(group: Any) -> list[tuple[str, Any]]:
    """Members reached by hard links only: a soft or external link may lead out of the file or in a circle."""
    import h5py

    return [(key, group[key]) for key in group if isinstance(group.get(key, getlink=True), h5py.HardLink)]


def _plain(value: Any) -> float | str | None:
    """An attribute as a number or text; None for anything else (dimension scales, arrays)."""
    if isinstance(value, np.ndarray) and value.size == 1:
        value = value.flat[0]
    if isinstance(value, bytes):
        return value.decode("utf-8", "replace")
    if isinstance(value, str):
        return value
    return float(value) if isinstance(value, int | float | np.integer | np.floating) else None


FORMAT = FileFormat(
    name="HDF5",
    description="HDF5 (MATLAB v7.3 included)",
    matches=lambda head: any(head.startswith(SIGNATURE, at) for at in SIGNATURE_OFFSETS),
    load=load_hdf5,
)
