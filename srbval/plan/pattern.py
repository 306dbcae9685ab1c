"""Which harmonic of a fault line is missing, and what sets it: the paper's remark on Figure 12, tested.

A rectangular pulse of length tau, repeated at f, lacks its harmonic 1 / (f tau) (the paper's eq. 20). Measured on
envelope spectra the missing one is found where the heights change sign.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from srbval.bearing import load_bearing
from srbval.models.planar.pulse import Pulse, pulse_of
from srbval.models.run import Run
from srbval.plan.questions import line_heights
from srbval.reading.analyse import analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import recording_from_run

HARMONICS = 10
WIDE_BAND_HZ = (300.0, 3300.0)  # preserves a pulse's shape: more than ten times BPFO on either side of its middle


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
