"""Which harmonic of a fault line is missing, and what sets it: the paper's remark on Figure 12, tested.

A rectangular pulse of length tau, repeated at f, lacks its harmonic 1 / (f tau) (the paper's eq. 20). Measured on
envelope spectra the missing one is found where the heights change sign.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from srbval.bearing import RACE_DEFECTS, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.planar import ring_kernel
from srbval.models.planar.ring import make_ring
from srbval.models.run import Run
from srbval.plan.questions import line_heights
from srbval.reading.analyse import analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import recording_from_run
from srbval.scene import Scene

HARMONICS = 10
FELT = 0.01  # of a pulse's height: where it begins and ends
WIDE_BAND_HZ = (300.0, 3300.0)  # preserves a pulse's shape: more than ten times BPFO on either side of its middle


@dataclass(frozen=True, kw_only=True)
class Pulse:
    """Force pulse of a race's defect under a roller in the middle of the load zone, the ring held.

    `length_m` along the race from where it is first felt to where it is last; `pitch_m` between two rollers there.
    """

    length_m: float
    pitch_m: float

    @property
    def share(self) -> float:
        """Pulse length over the passing period, f tau of eq. (20): the same at every speed."""
        return self.length_m / self.pitch_m


def pulse_of(scene: Scene) -> Pulse:
    """The pulse of the scene's first defect, on a race; `ConfigurationError` where there is none."""
    if scene.defect.kind not in RACE_DEFECTS:
        raise ConfigurationError(f"defect {scene.defect.kind.scene_word}: only a race's defect has a pulse length.")
    ring = make_ring(scene, load_bearing(scene.bearing))
    zone = np.array([math.cos(scene.load.zone_rad), math.sin(scene.load.zone_rad)])
    at = (-float(ring.balance_m() @ zone) - ring.kernel.bump_start) / ring.kernel.bump_step
    pulse = ring.kernel.bumps[0, round(at)]
    felt = np.flatnonzero(pulse > FELT * pulse.max())
    return Pulse(
        length_m=2 * float(felt[-1]) * float(ring.kernel.defects[0, ring_kernel.POSITION_STEP]),
        pitch_m=2 * math.pi * float(ring.kernel.defects[0, ring_kernel.RACE_RADIUS]) / ring.kernel.rollers,
    )


@dataclass(frozen=True, kw_only=True)
class MissingHarmonic:
    """The missing harmonic: by the sinc of the pulse's length, and as measured in a wide band and in the paper's.

    A fraction where the heights pass zero between two harmonics. None: none of the first `HARMONICS` is missing.
    """

    pulse: Pulse
    by_sinc: float
    wide_band: float | None
    paper_band: float | None


def missing_of(run: Run) -> MissingHarmonic:
    """Read which harmonic a run with a race's defect, usable, lacks."""
    pulse = pulse_of(run.scene)
    return MissingHarmonic(
        pulse=pulse,
        by_sinc=1 / pulse.share,
        wide_band=missing_harmonic(harmonic_heights(run, WIDE_BAND_HZ)),
        paper_band=missing_harmonic(harmonic_heights(run, SIMULATED_BAND_HZ)),
    )


def harmonic_heights(run: Run, band_hz: tuple[float, float]) -> list[float]:
    """Heights of the first `HARMONICS` of the run's fault line, demodulated from a band, over the first one's."""
    bearing = load_bearing(run.scene.bearing)
    found = analyse(recording_from_run(run), bearing=bearing, band_hz=band_hz)
    line = found.line_of(run.scene.defect.kind)
    first = line.found_hz if line.found_hz is not None else line.kinematic_hz
    heights = line_heights(
        found.processed.envelope, found.processed.fs_hz, [k * first for k in range(1, HARMONICS + 1)]
    )
    return [height / heights[0] for height in heights]


def missing_harmonic(heights: Sequence[float]) -> float | None:
    """Where the first lobe of a harmonic pattern ends: the first local minimum, or between it and a neighbour.

    Heights are moduli, so a lobe that passes zero turns up again behind it; the change of sign is put where the slopes
    on both sides agree best.
    """
    for i in range(1, len(heights) - 1):
        before, here, after = heights[i - 1], heights[i], heights[i + 1]
        if here > before or here > after:
            continue
        behind = abs((before - here) - (here + after))  # passes zero behind this one
        ahead = abs((before + here) - (after - here))  # passed it ahead of this one
        if behind <= ahead:
            return i + 1 + here / (here + after)
        return i + before / (before + here)
    return None
