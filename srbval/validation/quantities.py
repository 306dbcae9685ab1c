"""What one analysed record says of a fault: line frequency, harmonic pattern and sidebands."""

from __future__ import annotations

import math
from dataclasses import dataclass

from srbval.bearing import Fault
from srbval.signal import LEAST_SNR, NORMAL_95
from srbval.validation.analyse import Analysis
from srbval.validation.lines import Line

HARMONICS = (2, 3, 4, 5)
_DB = 20 / math.log(10)


@dataclass(frozen=True, kw_only=True)
class Quantity:
    """One number of a record: `value` in `unit` with its reading's 95 % half width, and whether its line stands out.

    Frequencies are orders of the shaft; levels are of the squared envelope, in dB over the first harmonic, and
    `least` is the level from which a line would stand out of this record's noise.
    """

    name: str
    unit: str
    value: float
    ci95: float
    present: bool
    least: float = -math.inf


def quantities(analysis: Analysis, state: Fault) -> tuple[Quantity, ...]:
    """The quantities that `state`'s line gives in a record; those out of its reach are left out."""
    first = analysis.line_of(state)
    name = first.name
    if first.found_hz is None or not first.depth:
        return ()
    shaft = analysis.speed.value_hz
    found = [
        Quantity(
            name=name,
            unit="order",
            value=first.found_hz / shaft,
            ci95=(first.ci95_hz or 0.0) / shaft,
            present=first.detected,
        )
    ]
    for number in HARMONICS:
        found += _level(harmonic_name(name, number), first, _lines(analysis, name, number))
    if state.sidebands is not None:
        beside = state.sidebands
        sides = [*_lines(analysis, f"{name}-{beside}", 1), *_lines(analysis, f"{name}+{beside}", 1)]
        found += _level(f"{name} sidebands", first, sides)
    return tuple(found)


def harmonic_name(line: str, number: int) -> str:
    """``2xBPFO``; ``2 x 2xBSF`` where the line itself is a multiple."""
    return f"{number} x {line}" if line[0].isdigit() else f"{number}x{line}"


def _lines(analysis: Analysis, name: str, harmonic: int) -> list[Line]:
    return [x for x in analysis.lines if (x.name, x.harmonic) == (name, harmonic) and x.depth]


def _level(name: str, first: Line, lines: list[Line]) -> list[Quantity]:
    """Mean level of `lines` over the first; Rayleigh's scatter of an amplitude in noise gives its interval."""
    if not lines:
        return []
    depth = sum(line.depth or 0.0 for line in lines) / len(lines)
    spread = math.hypot(*(_scatter_db(line) / len(lines) for line in lines), _scatter_db(first))
    least = max((line.depth or 0.0) * math.sqrt(LEAST_SNR / max(line.snr or 0.0, 0.5)) for line in lines)
    return [
        Quantity(
            name=name,
            unit="dB",
            value=_DB * math.log(depth / (first.depth or 1.0)),
            ci95=NORMAL_95 * spread,
            present=first.detected and all(line.detected for line in lines),
            least=_DB * math.log(least / (first.depth or 1.0)),
        )
    ]


def _scatter_db(line: Line) -> float:
    """Standard error of a line's level [dB]: one over the root of twice its power over noise, at most one."""
    return _DB / math.sqrt(2 * max(line.snr or 0.0, 0.5))
