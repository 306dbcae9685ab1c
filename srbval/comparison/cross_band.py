"""Each side's fault line in its own demodulation band and in the other side's."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.errors import SrbvalError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import Line, line_entry


@dataclass(frozen=True, kw_only=True)
class CrossBand:
    """One record in one band [Hz]: the line of its state. `own` marks the band it is analysed in elsewhere.

    `why` says why a record has no reading in a band; its line then has no values.
    """

    state: Fault
    origin: str
    file: str
    band_hz: tuple[float, float]
    own: bool
    line: Line
    why: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        return vars(self) | line_entry(self.line)


def cross_bands(model: Mapping[Fault, Analysis], rig: Mapping[Fault, Analysis]) -> tuple[CrossBand, ...]:
    """Model and rig, outer and inner race, each in both sides' bands, its own band first.

    Both bands were fixed before these records were looked at, so neither costs a trial.
    """
    return tuple(
        _row(state, side, band_hz)
        for state in RACE_DEFECTS
        if state in model and state in rig
        for side, other in ((model[state], rig[state]), (rig[state], model[state]))
        for band_hz in dict.fromkeys((side.processed.band_hz, other.processed.band_hz))
    )


def _row(state: Fault, side: Analysis, band_hz: tuple[float, float]) -> CrossBand:
    line, why, own = side.line_of(state), "", band_hz == side.processed.band_hz
    if not own:
        try:
            line = analyse(side.recording, bearing=side.bearing, speed=side.speed, band_hz=band_hz).line_of(state)
        except SrbvalError as error:
            line, why = Line(name=line.name, harmonic=1, kinematic_hz=line.kinematic_hz), str(error)
    file = side.recording.file or side.recording.name
    return CrossBand(
        state=state, origin=side.recording.origin.value, file=file, band_hz=band_hz, own=own, line=line, why=why
    )
