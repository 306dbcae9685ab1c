"""How one analysed record's value of a compared quantity is read: line order, levels, shape of the spectrum."""

import math
from collections.abc import Callable

from srbval.bearing import Fault
from srbval.signal import LEAST_SNR, NORMAL_95
from srbval.validation.analyse import Analysis
from srbval.validation.comparison import QuantityValue
from srbval.validation.lines import Line
from srbval.validation.spectrum_shape import angle_within, halves_of

Read = Callable[[Analysis, Fault], QuantityValue | None]

_DB = 20 / math.log(10)


def line_order(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """The fault's line in orders of the shaft."""
    line, shaft_hz = analysis.line_of(fault), analysis.speed.value_hz
    if line.found_hz is None or not line.depth:
        return None
    return QuantityValue(
        value=line.found_hz / shaft_hz, ci95=(line.ci95_hz or 0.0) / shaft_hz, present=line.detected, line=line
    )


def harmonic_level(number: int) -> Read:
    """Level of a harmonic over the first [dB]."""

    def read(analysis: Analysis, fault: Fault) -> QuantityValue | None:
        return _level(analysis, fault, (fault.line,), number)

    return read


def sideband_level(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """Mean level of the sidebands next to the line over it [dB]; None for a fault without sidebands."""
    if fault.sidebands is None:
        return None
    return _level(analysis, fault, (f"{fault.line}-{fault.sidebands}", f"{fault.line}+{fault.sidebands}"), 1)


def spectrum_shape(analysis: Analysis, fault: Fault) -> QuantityValue | None:
    """Angle of the spectra of a record's halves with each other [degrees], see `srbval.validation.spectrum_shape`."""
    halves = halves_of(analysis, fault)
    if halves is None:
        return None
    within = angle_within(halves)
    line = analysis.line_of(fault)
    return QuantityValue(value=within.degrees, ci95=within.ci95, present=within.related, line=line, halves=halves)


def _level(analysis: Analysis, fault: Fault, names: tuple[str | None, ...], harmonic: int) -> QuantityValue | None:
    """Mean level of lines over the first harmonic [dB]; Rayleigh's scatter of an amplitude in noise is its interval.

    None where they are out of the record's reach.
    """
    first = analysis.line_of(fault)
    lines = [x for name in names for x in analysis.lines if (x.name, x.harmonic) == (name, harmonic) and x.depth]
    if first.found_hz is None or not first.depth or not lines:
        return None
    depth = sum(line.depth or 0.0 for line in lines) / len(lines)
    spread = math.hypot(*(_scatter_db(line) / len(lines) for line in lines), _scatter_db(first))
    least = max((line.depth or 0.0) * math.sqrt(LEAST_SNR / max(line.snr or 0.0, 0.5)) for line in lines)
    return QuantityValue(
        value=_DB * math.log(depth / first.depth),
        ci95=NORMAL_95 * spread,
        present=first.detected and all(line.detected for line in lines),
        least=_DB * math.log(least / first.depth),
        line=first,
    )


def _scatter_db(line: Line) -> float:
    """Standard error of a line's level [dB]: one over the root of twice its power over noise, at most one."""
    return _DB / math.sqrt(2 * max(line.snr or 0.0, 0.5))
