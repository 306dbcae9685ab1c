"""What of a run nothing measured has been held against: said with every run."""

from __future__ import annotations

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.errors import SrbvalError
from srbval.scene import Scene

AMPLITUDES = "amplitudes and the noise floor"


def not_validated(scene: Scene) -> tuple[str, ...]:
    """What no comparison with measurements covers in this scene, in words; amplitudes always.

    A bearing counts as validated that has the geometry of the paper's, whatever it is called.
    """
    found = [AMPLITUDES]
    bearing = _bearing(scene.bearing)
    if bearing is None or bearing.geometry != load_bearing(DEFAULT_BEARING).geometry:
        found.append(f"the bearing {scene.bearing}: the models were held against the {DEFAULT_BEARING} alone")
        if bearing is not None and bearing.geometry is None:
            found.append("everything but where lines lie: the bearing has no [geometry], so load zone, pulses and "
                         "resonance are assumed")  # fmt: skip
    if any(defect.kind is Fault.ROLLER for defect in scene.defects):
        found.append("a defect on a roller")
    if scene.load.axial_n or (scene.load_profile is not None and any(scene.load_profile.axial_n)):
        found.append("axial load")
    if scene.speed_profile is not None or scene.load_profile is not None:
        found.append("speed or load that varies over time")
    if scene.load.gravity:
        found.append("gravity")
    return tuple(found)


def _bearing(name: str) -> Bearing | None:
    try:
        return load_bearing(name)
    except SrbvalError:  # its file has gone since
        return None
