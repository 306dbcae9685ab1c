"""Named lines to look for in an envelope spectrum: harmonics of a fault line and their sidebands."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Cursor:
    """One named frequency [Hz]; a sideband is drawn fainter than a harmonic."""

    name: str
    frequency_hz: float
    sideband: bool = False


def fault_cursors(
    line: str,
    frequency_hz: float,
    *,
    f_max_hz: float,
    sideband_hz: float = 0.0,
    sideband_name: str = "fr",
    sidebands: int = 0,
) -> tuple[Cursor, ...]:
    """Cursors of all harmonics of `line` up to `f_max_hz`, each with `sidebands` on either side.

    Named as the field does: ``BPFI``, ``2xBPFI``, ``BPFI-fr``, ``2xBPFI+2fr``.
    """
    found = []
    for harmonic in range(1, int(f_max_hz // frequency_hz) + 1):
        name = line if harmonic == 1 else f"{harmonic}x{line}"
        found.append(Cursor(name, harmonic * frequency_hz))
        for k in range(-sidebands, sidebands + 1):
            at = harmonic * frequency_hz + k * sideband_hz
            if k and 0 < at <= f_max_hz:
                times = "" if abs(k) == 1 else str(abs(k))
                found.append(Cursor(f"{name}{'+' if k > 0 else '-'}{times}{sideband_name}", at, sideband=True))
    return tuple(sorted(found, key=lambda cursor: cursor.frequency_hz))
