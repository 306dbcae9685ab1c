"""Old names of `units`."""

from srbval.storage.units import LONGEST_TEXT, NUMBER_AND_UNIT, RANGES, SI_SUFFIX, UNITS, parse_quantity, shown

__all__ = ["LONGEST_TEXT", "NUMBER_AND_UNIT", "RANGES", "SI_SUFFIX", "UNITS", "parse_quantity", "shown"]
