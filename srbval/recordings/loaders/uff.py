"""Universal files, data set 58 (function at a degree of freedom, text or binary), by the library pyuff."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from srbval.errors import DataError
from srbval.recordings.loaders.limited import Library, limited_format
from srbval.recordings.raw import RawFile, Value

EXPANSION = 16  # the library holds a text's numbers as Python's own before it makes an array of them
FUNCTION = 58
GENERAL, TIME_RESPONSE = 0, 1  # function types of data set 58
ACCELERATION = 12  # specific data type of its ordinate
UNITS = 164
SI = 1  # units code of data set 164
EVEN = 1  # abscissa spacing
_MARK = re.compile(rb"^    -1[ \t]*\r?$", re.MULTILINE)
_HEAD = re.compile(rb" {4}-1[ \t]*\r?\n {0,5}\d{1,5}b?\s")


def load_uff(path: Path) -> RawFile:
    """Read the time signals: real ones of data sets 58 that are time responses or general functions.

    Named by their first identification line, with node and direction where that names more than one. The unit is the
    ordinate's label; without one it is m/s2 for an acceleration in a file whose data set 164 says SI.
    """
    import pyuff

    if len(_MARK.findall(path.read_bytes())) % 2:
        raise DataError(f"{path}: truncated: its last data set does not end. Copy it again.")
    file = pyuff.UFF(str(path))
    types = [int(kind) for kind in file.get_set_types()]
    functions = [file.read_sets(i) for i, kind in enumerate(types) if kind == FUNCTION]
    systems = {int(file.read_sets(i)["units_code"]) for i, kind in enumerate(types) if kind == UNITS}
    variables: dict[str, Value] = {}
    units: dict[str, str] = {}
    rates: dict[str, float] = {}
    for function in (f for f in functions if f["func_type"] in (GENERAL, TIME_RESPONSE)):
        name = _name(function, functions, len(variables))
        variables[name] = _samples(path, name, function)
        label = str(function["ordinate_axis_units_lab"]).strip()
        if label not in ("", "NONE"):
            units[name] = label
        elif function["ordinate_spec_data_type"] == ACCELERATION and systems == {SI}:
            units[name] = "m/s2"
        if function["abscissa_spacing"] != EVEN:
            variables[f"{name}.time"] = np.asarray(function["x"])
        elif function["abscissa_inc"] > 0:
            rates[name] = 1 / float(function["abscissa_inc"])
    return RawFile(path=path, format=FORMAT.name, variables=variables, units=units, rates_hz=rates)


def _name(function: dict[str, Any], functions: list[dict[str, Any]], number: int) -> str:
    """What the first line of identification says; where others say the same, with the place of the sensor."""
    own = str(function["id1"]).strip()
    if own not in ("", "NONE") and [str(f["id1"]).strip() for f in functions].count(own) == 1:
        return own
    return f"{number + 1}: node {function['rsp_node']}, direction {function['rsp_dir']}"


def _samples(path: Path, name: str, function: dict[str, Any]) -> np.ndarray[Any, Any]:
    samples = np.asarray(function["data"])
    if samples.size != function["num_pts"]:
        raise DataError(
            f"{path}: truncated: {name!r} has {samples.size} of {function['num_pts']} samples. Copy it again."
        )
    return samples


FORMAT = limited_format(
    name="UFF58",
    description="universal file (UFF, data set 58)",
    matches=lambda head: _HEAD.match(head) is not None,
    load=load_uff,
    kind="universal file",
    library=Library("pyuff", "pyuff", "srbval[formats]"),
    expansion=EXPANSION,
)
