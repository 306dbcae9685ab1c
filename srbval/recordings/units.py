"""Units in files, and names of times, rates and units, from the table ``units.csv``.

To add a spelling of a unit, write it in the unit's row without its blanks, dots, carets and parentheses. Upper and
lower case are distinguished in spellings of one letter only. The `kind` of a row is ``signal`` (a unit of a sensor's
signal, with the unit to which a recording converts it and the factor), ``other`` (rotations and other quantities),
``time``, ``rate`` or ``name``. A ``name`` row is a pattern in lower case for the names of variables that contain times,
rates, time steps or units. Names of times are compared unchanged; from other names blanks, punctuation and prefixes
such as ``NI`` (National Instruments) are removed first.
"""

import csv
import math
import re
import unicodedata
from collections.abc import Mapping
from pathlib import Path

_UNIT_ROWS = tuple(csv.DictReader(Path(__file__).with_name("units.csv").read_text(encoding="utf-8").splitlines()))
PATTERNS = {row["unit"]: row["spellings"] for row in _UNIT_ROWS if row["kind"] == "name"}


def rows_by_spelling(*kinds: str) -> dict[str, Mapping[str, str]]:
    """Rows of ``units.csv`` with these kinds, by each spelling of their units."""
    rows = [row for row in _UNIT_ROWS if row["kind"] in kinds]
    return {word: row for row in rows for word in (*row["spellings"].split(), row["unit"])}


ACCELERATION_UNIT, VELOCITY_UNIT, DISPLACEMENT_UNIT = "m/s2", "mm/s", "um"  # units in a recording
UNKNOWN = "unknown"
ENVELOPE = "gE"  # acceleration envelope computed by a meter
CONVERTER_COUNTS = "counts"  # whole numbers of a converter, without a scale
# unit of files and options -> unit of the stored samples and factor to it
UNITS: dict[str, tuple[str, float]] = {
    row["unit"]: (row["kept"], float(row["factor"])) for row in _UNIT_ROWS if row["kind"] == "signal"
}
DERIVATIVES = {VELOCITY_UNIT: 1, DISPLACEMENT_UNIT: 2}  # order of the derivative from a unit to an acceleration
SI_FACTORS = {VELOCITY_UNIT: 1e-3, DISPLACEMENT_UNIT: 1e-6}  # to m/s and m
# units of a speed and an angle of rotation, and the factors to Hz and to revolutions
SPEED_HZ = {"rpm": 1 / 60, "Hz": 1.0, "rad/s": 1 / (2 * math.pi)}
REVOLUTIONS = {"rad": 1 / (2 * math.pi), "deg": 1 / 360, "rev": 1.0}
OTHER_QUANTITIES = {row["unit"] for row in _UNIT_ROWS if row["kind"] == "other"} - {*SPEED_HZ, *REVOLUTIONS, ENVELOPE}
# Units so small that a sensor may state whole numbers of them.
FINE_UNITS = ("mg", "mm/s2", "um/s", "um", "nm", "mV", "uV", CONVERTER_COUNTS, UNKNOWN)
_SPELLED = {word: row["unit"] for word, row in rows_by_spelling("signal", "other").items()}
_SPELLED = {word.lower(): unit for word, unit in _SPELLED.items() if len(word) > 1} | _SPELLED
_SHORT = ("m", "in", "A", "N", "W", "%", "degC", "degF", "deg", "rev")  # no units after a name without brackets
_AMPLITUDE_KIND = re.compile(r"(?<=.)[ _]?(?:rms|eff|pk-?pk|p-?p|0-?p|pk|peak|true)$", re.IGNORECASE)
_IN_NAME = re.compile(r"(.*?\S)\s*(?:[\[({]\s*([^\[\]{}]*?)\s*[\])}]|\s(?:in|/)\s+(\S+))")
_UNIT_SUFFIX = re.compile(r"(.*?\w)(?:\s*[,;:/-]\s*|[\s_]+)((?:m|mm|rad|in|g)_[a-z]\w*|[^\s_]+)")


def known_unit(text: str) -> str | None:
    """Unit (of a vibration, a rotation or another quantity) that a text from a file means; None if it is unknown."""
    plain = re.sub(r"[\s^*·().\[\]]", "", unicodedata.normalize("NFKC", text)).replace("\u2212", "-")
    plain = re.sub("^[\u03bc\u00b5]", "u", plain)
    bare = _AMPLITUDE_KIND.sub("", plain)
    words = (case for word in (plain, bare) for case in (word, word.lower() if len(word) > 1 else word))
    return next((unit for word in words if (unit := _SPELLED.get(word))), None)


def split_unit(name: str) -> tuple[str, str | None]:
    """Split a column's title into name and unit: ``acc DE [g]``, ``a / (m/s²)``, ``acc in g``, ``acc_g``, ``g``."""
    if found := _IN_NAME.fullmatch(name):
        return found[1], found[2] or found[3] or None
    behind = _UNIT_SUFFIX.fullmatch(name)
    for title, unit in ((behind[1], behind[2]) if behind else (name, ""), (name, name)):
        if (known := known_unit(unit)) and known not in _SHORT:
            return title, unit
    return name, None


def is_unit_key(name: str) -> bool:
    """True if an attribute with this name states the unit of samples, such as ``units`` or ``NI_UnitDescription``."""
    plain = re.sub(r"[\W_]", "", name.rpartition(".")[2].lower())
    return re.fullmatch(rf"(?:ni|nicm)?(?:{PATTERNS['unit']})", plain) is not None
