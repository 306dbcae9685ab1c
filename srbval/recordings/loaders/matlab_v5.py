"""MATLAB v5 to v7 files, by scipy.io in a process with limits: a few flipped bits make it crash or take gigabytes."""

import math
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.limited import Library, limited_format
from srbval.recordings.raw import RawFile, Value, check_claim

HEADER_BYTES = 128
TITLE, VERSION_AND_ENDIAN = b"MATLAB 5.0", (b"\x00\x01IM", b"\x01\x00MI")  # the latter at bytes 124 to 127
EXPANSION = 4  # compressed once, and held twice while the contents are handed over
MAX_DEPTH = 32
MAX_VARIABLES = 25_000


def load_matlab_v5(path: Path) -> RawFile:
    """Read every numeric array, text and (nested) struct field of a MATLAB v5 file, as stored, never converted.

    Cells and structs of one element are unwrapped; of larger ones each element's index goes into its name.
    Complex and sparse arrays, function handles and Java objects are left out.
    """
    from scipy.io import loadmat, whosmat

    for name, shape, _ in whosmat(path):
        check_claim(path, math.prod(shape), f"{name!r}")
    variables: dict[str, Value] = {}
    for name, value in loadmat(path).items():
        if not name.startswith("__"):  # scipy's own, and what MATLAB itself stores without a name
            _collect(variables, name, value, 0)
    return RawFile(path=path, format=FORMAT.name, variables=variables)


def _collect(variables: dict[str, Value], name: str, value: Any, depth: int) -> None:
    from scipy.io.matlab import MatlabFunction, MatlabOpaque

    if not isinstance(value, np.ndarray) or isinstance(value, MatlabFunction | MatlabOpaque):
        return
    if depth > MAX_DEPTH or len(variables) >= MAX_VARIABLES:
        most = f"{MAX_DEPTH} levels and {MAX_VARIABLES} variables"
        raise DataError(f"{name[:99]!r} is beyond the {most} that are read at most. Not a recording.")
    if value.dtype.kind == "U":
        variables[name] = "".join(value.ravel(order="F")).strip()
    elif value.dtype.kind in "fiu":
        variables[name] = value
    elif value.dtype.kind in "OV":
        for i, element in enumerate(value.ravel(order="F"), 1):
            place = name if value.size == 1 else f"{name}({i})"
            for field in value.dtype.names or ("",):
                member = element[field] if field else element
                _collect(variables, f"{place}.{field}" if field else place, member, depth + 1)


FORMAT = limited_format(
    name="MATLAB v5",
    description="MATLAB v5",
    matches=lambda head: head.startswith(TITLE) or head[124:HEADER_BYTES] in VERSION_AND_ENDIAN,
    load=load_matlab_v5,
    library=Library("scipy.io.matlab", "scipy", "srbval"),
    expansion=EXPANSION,
)
