"""What a scene's values are for a bearing of another size: those of a geometrically similar machine.

Lengths go with the size, forces and dampings with its square, masses with its cube, stiffnesses with itself: times of
elastic bodies then go with the size, and stresses stay. The friction law's velocity stays as well, and so does the
shaft's speed. (Dimensional analysis with the same materials; Bridgman 1922.)
"""

import math
from dataclasses import replace
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Bearing, load_bearing
from srbval.scene.scene import Scene

SAME = 1e-9  # sizes nearer than this are one
# A bearing in its machine: nothing carries the load past it, and the damper beside the spring is gone as well.
IN_ITS_MACHINE: dict[str, Any] = {"load": {"path": "bearing"}, "housing": {"damping": "0 Ns/m"}}
# Of one of another size the joints of the machine damp it as those of the rig do: see `rig_inputs.toml`.
JOINTS: dict[str, Any] = {"housing": {"damping": "3.1e4 Ns/m"}}
# Besides, of a ball or cylindrical roller bearing: a defect as one makes for tests, in size as the rig's drill is to
# the rig's bearing.
NOT_SPHERICAL = IN_ITS_MACHINE | {"model": "planar", "defect": {"shape": "hole", "extent": "2 mm", "height": "-0.5 mm"}}
DAMPING_RATIO = 0.05  # assumed, of the housing on its spring; the paper's 0.41 leaves no resonance
WITHOUT_DIMENSIONS = {"model": "impulse"}


def similar_parts(scene: Scene, size: float) -> Scene:
    """The scene with all but its bearing `size` times as large, at the same shaft speed."""
    contact, housing, bodies, defect, load = scene.contact, scene.housing, scene.bodies, scene.defect, scene.load
    return replace(
        scene,
        load=replace(load, radial_n=load.radial_n * size**2, axial_n=load.axial_n * size**2),
        contact=replace(
            contact, stiffness_n_m=contact.stiffness_n_m * size, damping_ns_m=contact.damping_ns_m * size**2,
            smoothing_width_m=contact.smoothing_width_m * size, radial_play_m=contact.radial_play_m * size,
        ),
        housing=replace(
            housing, mass_kg=housing.mass_kg * size**3, stiffness_n_m=housing.stiffness_n_m * size,
            damping_ns_m=housing.damping_ns_m * size**2,
        ),
        bodies=replace(
            bodies, cage_mass_kg=bodies.cage_mass_kg * size**3, pocket_offset_m=bodies.pocket_offset_m * size
        ),
        defect=replace(defect, **{key: value * size for key, value in vars(defect).items() if is_length(key, value)}),
    )  # fmt: skip


def is_length(key: str, value: Any) -> bool:
    """Whether a field's name says that it is a length, and it is given."""
    return key.endswith("_m") and value is not None


def size_of(bearing: Bearing) -> float | None:
    """Pitch diameter over that of the default bearing, for which the bundled scenes were written; None without one."""
    own, usual = bearing.pitch_diameter_m, load_bearing(DEFAULT_BEARING).pitch_diameter_m
    return None if own is None or usual is None else own / usual


def for_size(base: Scene, size: float, *, spherical: bool) -> dict[str, Any]:
    """What changes in the table of `base` for a bearing of that size, in SI; its step with the times of the bodies.

    Of a bearing that is not `spherical` the housing's damping is `DAMPING_RATIO`.
    """
    scaled = similar_parts(base, size)
    table: dict[str, Any] = {
        part: {k: v for k, v in vars(getattr(scaled, part)).items() if v != vars(getattr(base, part))[k]}
        for part in ("load", "contact", "housing", "bodies", "defect")
    }
    if spherical:
        steps = max(1, math.ceil(base.steps_per_output / size - SAME))
        return table | {"solver": {"step_s": 1 / (base.output_rate_hz * steps)}}
    housing = scaled.housing
    damping = 2 * DAMPING_RATIO * math.sqrt(housing.mass_kg * housing.stiffness_n_m)
    return table | {"housing": table["housing"] | {"damping_ns_m": damping}}
