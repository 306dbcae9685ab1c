"""Each side's fault line in its own demodulation band and in the other side's."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.errors import SrbvalError
from srbval.validation.analyse import Analysis, analyse


@dataclass(frozen=True, kw_only=True)
class CrossBand:
    """One record in one band [Hz]: the line of its state. `own` marks the band it is analysed in elsewhere.

    `kinematic_hz` is what `deviation_pct` counts from; `why` says why a record has no reading in a band.
    """

    state: Fault
    origin: str
    file: str
    band_hz: tuple[float, float]
    own: bool
    line: str
    kinematic_hz: float | None = None
    found_hz: float | None = None
    ci95_hz: float | None = None
    deviation_pct: float | None = None
    snr: float | None = None
    depth: float | None = None
    detected: bool = False
    why: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for ``report.json``."""
        return dataclasses.asdict(self) | {"state": self.state.value}


def cross_bands(model: Mapping[Fault, Analysis], rig: Mapping[Fault, Analysis]) -> tuple[CrossBand, ...]:
    """Model and rig, outer and inner race, each in both sides' bands, its own band first.

    Both bands were fixed before these records were looked at, so neither costs a trial.
    """
    return tuple(
        row
        for state in RACE_DEFECTS
        if state in model and state in rig
        for side, other in ((model[state], rig[state]), (rig[state], model[state]))
        for row in _both(state, side, other)
    )


def _both(state: Fault, side: Analysis, other: Analysis) -> Iterator[CrossBand]:
    yield _row(state, side, side.processed.band_hz, own=True)
    band_hz = other.processed.band_hz
    if band_hz == side.processed.band_hz:
        return
    try:
        crossed = analyse(side.recording, bearing=side.bearing, speed=side.speed, band_hz=band_hz)
    except SrbvalError as error:
        yield dataclasses.replace(_empty(state, side, band_hz), why=str(error))
        return
    yield _row(state, crossed, band_hz, own=False)


def _empty(state: Fault, side: Analysis, band_hz: tuple[float, float]) -> CrossBand:
    recording = side.recording
    return CrossBand(
        state=state,
        origin=recording.origin.value,
        file=recording.file or recording.name,
        band_hz=band_hz,
        own=False,
        line=state.line or "",
    )


def _row(state: Fault, analysis: Analysis, band_hz: tuple[float, float], *, own: bool) -> CrossBand:
    line = analysis.line_of(state)
    return dataclasses.replace(
        _empty(state, analysis, band_hz),
        own=own,
        kinematic_hz=line.kinematic_hz,
        found_hz=line.found_hz,
        ci95_hz=line.ci95_hz,
        deviation_pct=line.deviation_pct,
        snr=line.snr,
        depth=line.depth,
        detected=line.detected,
    )
