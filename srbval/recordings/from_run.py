"""A simulated run as a recording: the same type as a measured file."""

import numpy as np

from srbval.models.run import Run
from srbval.recordings.recording import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.recordings.speed import RPM_PER_HZ, profile_signal


def recording_from_run(run: Run) -> Recording:
    """The outer ring's acceleration with its radial axes x and y, to be rotated onto the sensor's direction.

    Does not look at the run's status: check that first, a failed run is no vibration.
    """
    scene = run.scene
    profile = scene.speed_profile
    return Recording(
        name=f"{scene.model} model, {scene.defect.kind.scene_word} defect, {scene.shaft_hz * RPM_PER_HZ:.6g} rpm",
        origin=Origin.SIMULATED,
        channels={a: np.ascontiguousarray(run.acceleration_m_s2[:, i]) for i, a in enumerate("xyz")},
        axes=("x", "y"),
        fs_hz=scene.output_rate_hz,
        unit="m/s2",
        speed=ShaftSpeed(value_hz=scene.shaft_hz, ci95_hz=0.0, source=SpeedSource.PRESCRIBED),
        speed_signal=None
        if profile is None
        else profile_signal(np.array(profile.time_s), np.array(profile.speed_rad_s), run.seconds),
        bearing=scene.bearing,
        state=scene.defect.kind,
        radial_n=scene.load.radial_n,
        axial_n=scene.load.axial_n,
        notes=(f"not validated: {'; '.join(run.not_validated)}",),
    )
