"""How long a roller feels a defect, beside how far apart rollers follow: what sets a fault's harmonic pattern."""

import math
from dataclasses import dataclass

import numpy as np

from srbval.bearing import RACE_DEFECTS, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.planar import ring_kernel
from srbval.models.planar.rung import make_ring
from srbval.models.run_statistics import RunStatistics
from srbval.scene import Scene

FELT = 0.01  # of the pulse's height: where it begins and ends


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
    ring = make_ring(RunStatistics(scene=scene, bearing=load_bearing(scene.bearing)))
    zone = np.array([math.cos(scene.load.zone_rad), math.sin(scene.load.zone_rad)])
    at = (-float(ring.balance_m() @ zone) - ring.kernel.bump_start) / ring.kernel.bump_step
    pulse = ring.kernel.bumps[0, round(at)]
    felt = np.flatnonzero(pulse > FELT * pulse.max())
    return Pulse(
        length_m=2 * float(felt[-1]) * float(ring.kernel.defects[0, ring_kernel.POSITION_STEP]),
        pitch_m=2 * math.pi * float(ring.kernel.defects[0, ring_kernel.RACE_RADIUS]) / ring.kernel.rollers,
    )
