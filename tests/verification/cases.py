"""States at which the equations of motion are checked: near rolling, with everything moving."""

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.verification import harness
from tests.verification.world import Contacts, World

DEFECTS = {
    "healthy": {"kind": "none"},
    "outer": {"kind": "outer", "row": 1, "circle": 2, "points": 3, "height": "0.05 mm"},
    "inner": {"kind": "inner", "row": 2, "circle": 3, "points": 3, "height": "0.05 mm"},
    "roller": {"kind": "roller", "extent": "6 mm", "height": "0.04 mm"},
    "fine": {"kind": "inner", "extent": "3 mm", "height": "-0.02 mm", "refinement": 5},
}
EVERYTHING: dict[str, Any] = {  # all forces at once, none along an axis of symmetry
    "load": {"radial": "124.8 kN", "axial": "30 kN", "direction": "-70 deg", "gravity": True},
    "contact": harness.PRINTED_FIT,
    "defect": DEFECTS["outer"],
    "further_defects": [DEFECTS["inner"]],
    "bodies": {"row_stagger": 0.5},
    "settle": "0.01 s",
    "duration": "0.1 s",
    "speed_profile": {"time_s": [0.0, 0.02, 0.1], "speed_rad_s": [60.0, 80.0, 70.0]},
    "load_profile": {"time_s": [0.0, 0.1], "radial_n": [120e3, 90e3], "axial_n": [30e3, 5e3]},
}
TWO_CAGES = "every force at once, two cages"
BACKWARDS = "interference, defects off the load zone, shaft turning back"
TURNED: dict[str, Any] = {
    "load": {"axial": "20 kN", "direction": "-72 deg"},
    "contact": harness.PRINTED_FIT,
    "defect": DEFECTS["roller"] | {"row": 2, "roller": 6, "angle": "9 deg"},
    "further_defects": [DEFECTS["outer"] | {"angle": "-19 deg"}, DEFECTS["inner"] | {"angle": "19 deg"}],
}
CASES: dict[str, tuple[dict[str, Any], float]] = {  # scene, and time of the state
    "play, paper's case": ({"defect": DEFECTS["healthy"]}, 0.0123),
    # ring far down: contacts of 0 to 0.17 mm, so that both narrow and wide windows are looked up, neighbours differ
    "play, deep contacts": ({"load": {"radial": "900 kN"}, "defect": DEFECTS["healthy"]}, 0.0),
    "interference, outer-race defect": ({"contact": harness.PRINTED_FIT, "defect": DEFECTS["outer"]}, 0.0),
    "interference, inner-race defect": ({"contact": harness.PRINTED_FIT, "defect": DEFECTS["inner"]}, 0.0),
    "interference, damaged roller": ({"contact": harness.PRINTED_FIT, "defect": DEFECTS["roller"]}, 0.0),
    "interference, pit with finer points": ({"contact": harness.PRINTED_FIT, "defect": DEFECTS["fine"]}, 0.0),
    "every force at once, changing speed and load": (EVERYTHING, 0.0217),
    TWO_CAGES: (harness.merged(EVERYTHING, {"bodies": {"cages": 2}}), 0.004),  # while settling
    BACKWARDS: (TURNED, 0.00445),
}


def in_short_form(names: Iterable[str]) -> list[Any]:
    """Names of cases as parameters: `TWO_CAGES`, whose kernels nothing else uses, is compiled in the long form only.

    The short form runs it uncompiled, beside the planted errors.
    """
    return [pytest.param(name, marks=pytest.mark.long_form if name == TWO_CAGES else ()) for name in names]


def subject(*changes: dict[str, Any]) -> tuple[harness.Parameters, World]:
    """The model of the paper's scene with changes laid over each other, and the same in world axes."""
    scene = harness.paper_scene(**harness.merged(*changes))
    return harness.parameters(scene), World(scene)


class Case(NamedTuple):
    """A model at a state, its rates, and the same in world axes."""

    model: harness.Parameters
    world: World
    time: float
    y: harness.FloatArray
    found: harness.Rates
    expected: Contacts


def make_case(name: str) -> Case:
    """Model and world formulation of one of `CASES`."""
    changes, t = CASES[name]
    model, world = subject(changes)
    if name == BACKWARDS:
        model, world = harness.shaft_reversed(model), World(world.scene, turning=-1)
    y = disturbed(harness.rolling_state(model), seed=len(name), cage_angle=world.scene.load.zone_rad)
    return Case(model, world, t, y, harness.rates(model, t, y), world.contacts(t, y))


def disturbed(
    start: harness.FloatArray, seed: int, *, cage_angle: float = 0.0, tilt_rad: float = 2e-4, off_m: float = 1e-5
) -> harness.FloatArray:
    """A state with everything moved a little, the ring by about `off_m`, and all velocities; cage at `cage_angle`."""
    rng, y, where = np.random.default_rng(seed), start.copy(), harness.layout_of(start)
    y[where.slide] += rng.normal(0, off_m / 2, where.rollers)
    y[where.rotation] += rng.uniform(0.02, 0.1, where.rollers)
    y[where.cage] += [*rng.normal(0, tilt_rad, 2), cage_angle]
    y[where.ring] += rng.normal(0, off_m, 3)
    y[where.slide_rate] += rng.normal(0, 0.02, where.rollers)
    y[where.spin] += rng.normal(0, 1.0, where.rollers)
    y[where.cage_rate] += rng.normal(0, [0.5, 0.5, 0.05])
    y[where.ring_rate] += rng.normal(0, 0.01, 3)
    y[where.relative_angle] += 0.05
    y[where.relative_rate] += 0.8
    return y
