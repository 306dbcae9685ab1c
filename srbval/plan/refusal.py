"""Whether a rung can run a scene at all: what it would say if it were asked to."""

from srbval.bearing import Bearing
from srbval.errors import ConfigurationError
from srbval.models.full.parameters import geometry_of
from srbval.models.kinematic import refuse_axial
from srbval.models.ladder import Rung
from srbval.models.planar.rung import make_ring
from srbval.scene import Scene

IN_THE_PLANE = ("impulse", "planar")


def refusal(rung: Rung, scene: Scene, bearing: Bearing) -> str | None:
    """Why the rung refuses the scene; None where it assembles it."""
    try:
        rung.check_surface(scene)
        if not rung.runs(bearing):
            geometry_of(bearing, rung.name)
        elif rung.parameters is not None:
            rung.make_parameters(scene, geometry_of(bearing))
        elif rung.name in IN_THE_PLANE:
            refuse_axial(scene)
            if bearing.pitch_diameter_m is not None:
                make_ring(scene, bearing)
    except ConfigurationError as error:
        return str(error)
    return None
