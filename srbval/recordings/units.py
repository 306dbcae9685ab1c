"""Units of signals: the unit that a recording keeps, the factor to it, and spellings in files (``units.toml``)."""

import functools
import math
import re
import tomllib
import unicodedata
from importlib.resources import files

from srbval.scene.parts import STANDARD_GRAVITY_M_S2

SPELLED = tomllib.loads((files("srbval.recordings") / "units.toml").read_text(encoding="utf-8"))
ACCELERATION, VELOCITY, DISPLACEMENT = "m/s2", "mm/s", "um"  # kept by a recording
UNKNOWN = "unknown"
ENVELOPE = "gE"  # a meter's acceleration envelope, which is demodulated already
COUNTS = "counts"  # of a converter: whole numbers without a scale
# unit of files and options -> unit of the stored samples and factor to it
UNITS: dict[str, tuple[str, float]] = {
    unit: (ACCELERATION, factor * STANDARD_GRAVITY_M_S2) if kept == "g" else (kept, factor)
    for unit, (kept, factor, _) in SPELLED["signals"].items()
}
DERIVATIVES = {VELOCITY: 1, DISPLACEMENT: 2}  # order of the derivative that makes an acceleration of a unit
SI_FACTORS = {VELOCITY: 1e-3, DISPLACEMENT: 1e-6}  # to m/s and m
DIFFERENTIATED = {1: "m/s", 2: "m"}  # units of samples of which only the order of the derivative is stated
# units of a speed and an angle of rotation, and the factors to Hz and to revolutions
SPEED_HZ = {"rpm": 1 / 60, "Hz": 1.0, "rad/s": 1 / (2 * math.pi)}
REVOLUTIONS = {"rad": 1 / (2 * math.pi), "deg": 1 / 360, "rev": 1.0}
OTHERS = {*SPELLED["others"]} - {*SPEED_HZ, *REVOLUTIONS, ENVELOPE}
FINE = ("mg", "mm/s2", "um/s", "um", "nm", "mV", "uV", COUNTS, UNKNOWN)  # of which sensors state whole numbers
_SHORT = ("m", "in", "A", "N", "W", "%", "degC", "degF", "deg", "rev")  # mean no unit behind a name
_KIND = re.compile(r"(?<=.)[ _]?(?:rms|eff|pk-?pk|p-?p|0-?p|pk|peak|true)$", re.IGNORECASE)
_IN_NAME = re.compile(r"(.*?\S)\s*(?:[\[({]\s*([^\[\]{}]*?)\s*[\])}]|\s(?:in|/)\s+(\S+))")
_BEHIND = re.compile(r"(.*?\w)(?:\s*[,;:/-]\s*|[\s_]+)((?:m|mm|rad|in|g)_[a-z]\w*|[^\s_]+)")


@functools.cache
def _spellings() -> dict[str, str]:
    rows = {unit: row[-1] for unit, row in SPELLED["signals"].items()} | SPELLED["others"]
    known = {word: unit for unit, words in rows.items() for word in (*words.split(), unit)}
    return {word.lower(): unit for word, unit in known.items() if len(word) > 1} | known


def known_unit(text: str) -> str | None:
    """The unit of signals, rotations or other quantities that a text out of a file means, None for any other."""
    plain = re.sub(r"[\s^*·().\[\]]", "", unicodedata.normalize("NFKC", text)).replace("\u2212", "-")
    plain = re.sub("^[\u03bc\u00b5]", "u", plain)
    words = (case for word in (plain, _KIND.sub("", plain)) for case in (word, word.lower() if len(word) > 1 else word))
    return next((unit for word in words if (unit := _spellings().get(word))), None)


def split_unit(name: str) -> tuple[str, str | None]:
    """Split a column's title into its name and unit: ``acc DE [g]``, ``a / (m/s²)``, ``acc in g``, ``acc_g``, ``g``."""
    if found := _IN_NAME.fullmatch(name):
        return found[1], found[2] or found[3] or None
    behind = _BEHIND.fullmatch(name)
    for title, unit in ((behind[1], behind[2]) if behind else (name, ""), (name, name)):
        if (known := known_unit(unit)) and known not in _SHORT:
            return title, unit
    return name, None


def is_unit_key(name: str) -> bool:
    """True if a value of this name, of any program, is a unit of samples."""
    plain = re.sub(r"[\W_]", "", name.rpartition(".")[2].lower())
    return re.fullmatch(rf"(?:ni|nicm)?(?:{SPELLED['names']['unit']})", plain) is not None
