"""States at which the equations of motion are checked: near rolling, with everything moving."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from tests.verification.harness import (
    PRINTED_FIT,
    FloatArray,
    Parameters,
    Rates,
    Scene,
    geometry,
    layout_of,
    merged,
    paper_scene,
    parameters,
    rates,
    rolling_state,
    shaft_reversed,
)
from tests.verification.world import Contacts, World

DEFECTS = {
    "healthy": {"kind": "none"},
    "outer": {"kind": "outer", "row": 1, "circle": 2, "points": 3, "height": "0.05 mm"},
    "inner": {"kind": "inner", "row": 2, "circle": 3, "points": 3, "height": "0.05 mm"},
    "roller": {"kind": "roller", "extent": "6 mm", "height": "0.04 mm", "shape": "cosine"},
    "fine": {"kind": "inner", "extent": "3 mm", "height": "-0.02 mm", "shape": "cosine", "refinement": 5},
}
EVERYTHING: dict[str, Any] = {  # all forces at once, none along an axis of symmetry
    "load": {"radial": "124.8 kN", "axial": "30 kN", "direction": "-70 deg", "gravity": True},
    "contact": PRINTED_FIT,
    "defect": DEFECTS["outer"],
    "further_defects": [DEFECTS["inner"]],
    "bodies": {"row_stagger": 0.5},
    "settle": "0.01 s",
    "duration": "0.1 s",
    "speed_profile": {"time_s": [0.0, 0.02, 0.1], "speed_rad_s": [60.0, 80.0, 70.0]},
    "load_profile": {"time_s": [0.0, 0.1], "radial_n": [120e3, 90e3], "axial_n": [30e3, 5e3]},
}
BACKWARDS = "interference, defects off the load zone, shaft turning back"
TURNED: dict[str, Any] = {
    "load": {"axial": "20 kN", "direction": "-72 deg"},
    "contact": PRINTED_FIT,
    "defect": DEFECTS["roller"] | {"row": 2, "roller": 6, "angle": "9 deg"},
    "further_defects": [DEFECTS["outer"] | {"angle": "-19 deg"}, DEFECTS["inner"] | {"angle": "19 deg"}],
}
CASES: dict[str, tuple[dict[str, Any], float]] = {  # scene, and time of the state
    "play, paper's case": ({"defect": DEFECTS["healthy"]}, 0.0123),
    # ring far down: contacts of 0 to 0.17 mm, so that both narrow and wide windows are looked up, neighbours differ
    "play, deep contacts": ({"load": {"radial": "900 kN"}, "defect": DEFECTS["healthy"]}, 0.0),
    "interference, outer-race defect": ({"contact": PRINTED_FIT, "defect": DEFECTS["outer"]}, 0.0),
    "interference, inner-race defect": ({"contact": PRINTED_FIT, "defect": DEFECTS["inner"]}, 0.0),
    "interference, damaged roller": ({"contact": PRINTED_FIT, "defect": DEFECTS["roller"]}, 0.0),
    "interference, pit with finer points": ({"contact": PRINTED_FIT, "defect": DEFECTS["fine"]}, 0.0),
    "every force at once, changing speed and load": (EVERYTHING, 0.0217),
    "every force at once, two cages": (merged(EVERYTHING, {"bodies": {"cages": 2}}), 0.004),  # while settling
    BACKWARDS: (TURNED, 0.00445),
}


class Subject(NamedTuple):
    """A scene, the model of it that is tested, and the same in world axes."""

    scene: Scene
    model: Parameters
    world: World


def subject(*changes: dict[str, Any], make: Callable[[Scene], Parameters] = parameters) -> Subject:
    """The paper's scene with changes laid over each other."""
    scene = paper_scene(**merged(*changes))
    return Subject(scene, make(scene), World(scene, geometry()))


@dataclass(frozen=True)
class Case:
    """A model at a state, its rates, and the same in world axes."""

    model: Parameters
    world: World
    time: float
    y: FloatArray
    found: Rates
    expected: Contacts


def make_case(name: str) -> Case:
    """Model and world formulation of one of `CASES`."""
    changes, t = CASES[name]
    scene, model, world = subject(changes)
    if name == BACKWARDS:
        model, world = shaft_reversed(model), World(scene, geometry(), turning=-1)
    y = disturbed(model, seed=len(name), cage_angle=scene.load.zone_rad)
    return Case(model, world, t, y, rates(model, t, y), world.contacts(t, y))


def disturbed(model: Parameters, seed: int, cage_angle: float) -> FloatArray:
    """A state near rolling: slides, tilts, ring, spins off their places, one roller of each row at `cage_angle`."""
    rng = np.random.default_rng(seed)
    y = rolling_state(model)
    where = layout_of(y)
    y[where.slide] += rng.normal(0, 5e-6, where.rollers)
    y[where.rotation] += rng.uniform(0.02, 0.1, where.rollers)
    y[where.cage] += [*rng.normal(0, 2e-4, 2), cage_angle]
    y[where.ring] += rng.normal(0, 1e-5, 3)
    y[where.slide_rate] += rng.normal(0, 0.02, where.rollers)
    y[where.spin] += rng.normal(0, 1.0, where.rollers)
    y[where.cage_rate] += rng.normal(0, [0.5, 0.5, 0.05])
    y[where.ring_rate] += rng.normal(0, 0.01, 3)
    y[where.relative_angle] += 0.05
    y[where.relative_rate] += 0.8
    return y
