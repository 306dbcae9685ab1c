"""Division of the load of the simulated bearing, and frequencies at which rollers pass the points of its raceways."""

import math

from srbval.models.run import Run


def load_sharing(run: Run) -> dict[str, float]:
    """The radial load of a run and the parts of it that the housing's spring and the rollers carry [N]."""
    radial_n, share = run.scene.load.radial_n, run.roller_load_share
    spring_n = math.hypot(*(run.displacement_m.mean(axis=0))) * run.scene.housing.stiffness_n_m
    return {"radial_n": radial_n, "spring_n": spring_n, "roller_n": share * radial_n, "roller_load_share": share}


def point_passing(run: Run) -> dict[str, float]:
    """Frequencies at which rollers pass the points of the raceways in a run, numerical [Hz]."""
    points, shaft_hz = run.scene.contact.points_per_circle, run.scene.shaft_hz
    return {
        "points_per_circle": points,
        "shaft_rpm": 60 * shaft_hz,
        "outer_hz": points * run.cage_ratio * shaft_hz,
        "inner_hz": points * (1 - run.cage_ratio) * shaft_hz,
    }
