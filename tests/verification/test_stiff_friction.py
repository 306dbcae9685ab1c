"""Friction a thousand times stiffer still changes nothing for the implicit methods, at the paper's step.

Reason: friction with a critical velocity of 1 mm/s relaxes some 300 times faster than 1/61440 s; a method that is not
L-stable in it chatters, bounded by Coulomb's law and so without any sign of divergence. Source: in the Coulomb limit
the critical velocity has no say, and chatter is slip, so it shows in the power lost to friction: ode4 loses about twice
of what there is, whichever the stiffness.
"""

import numpy as np
import pytest

from srbval.models.run import EnergyFlow
from tests.verification.harness import PAPER_STEP_S, PRINTED_FIT, paper_scene, parameters, recorded, rolling_state

RUN_S = 6e-3
SETTLED_S = 2e-3
STIFF, STIFFER = "1 mm/s", "1e-6 m/s"
CAGE = 1e-4  # of the cage speed, which friction as a whole moves by 2.5e-3
FRICTION = 2e-3  # of the loss, which chatter doubles
CHATTER = 1.5  # times the implicit methods' loss: halfway to twice as much


def run(method: str, critical_velocity: str) -> tuple[float, float]:
    """Mean cage speed [rad/s] and power lost to friction [W]."""
    contact = PRINTED_FIT | {"critical_velocity": critical_velocity}
    model = parameters(paper_scene(contact=contact, defect={"kind": "outer", "angle": "4 deg"}))
    y = rolling_state(model)
    settling, intervals = (round(s / PAPER_STEP_S) for s in (SETTLED_S, RUN_S))
    record = recorded(model, y, step_s=PAPER_STEP_S, steps=1, method=method, outputs=intervals)
    energy: EnergyFlow = record["energy"]
    return float(record["cage_rad_s"][settling:].mean()), float(np.mean(energy.friction_w[settling:]))


@pytest.mark.parametrize("method", ["imex1", "imex2", "ros2"])
def test_stiffer_friction_changes_nothing(method: str) -> None:
    (cage, friction), (stiff_cage, stiff_friction) = run(method, STIFF), run(method, STIFFER)
    assert stiff_cage == pytest.approx(cage, rel=CAGE)
    assert stiff_friction == pytest.approx(friction, rel=FRICTION)


@pytest.mark.parametrize("critical_velocity", [STIFF, STIFFER])
def test_the_explicit_method_chatters(critical_velocity: str) -> None:
    assert run("ode4", critical_velocity)[1] > CHATTER * run("imex2", critical_velocity)[1]
