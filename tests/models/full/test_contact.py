"""A point that comes into contact within a step; all else of the contact law is tested in `tests/verification`."""

import numpy as np
import pytest

from srbval.models.full import columns as col
from srbval.models.full.contact_kernel import Candidates, ContactLaw, contact_columns
from srbval.models.full.motion_kernel import WITH_DAMPING

R, PROFILE = 0.020, 0.164
K, C, W, MU_S, MU_D, V_C = 5e7, 1e3, 1e-8, 0.7, 0.5, 1e-3
MEAN, MEAN_N = 2e-3, 1e-9  # of a force averaged over 20 000 moments, one of which sees the contact begin


def one_point(
    depth: float, velocity: tuple[float, float, float] = (0.0, 0.0, 0.0), along: float = 0.0, onset_s: float = 0.0
) -> tuple[float, ...]:
    """Force and torque of one ring point `depth` below the roller's surface at its +x side, `along` the axis.

    `velocity` is the ring's relative to the roller.
    """
    rho = np.sqrt((PROFILE - depth) ** 2 - along**2) - PROFILE + R
    points = np.zeros((1, 1, col.POINT_ROWS, 1))
    points[0, 0, :4, 0] = (rho, 0.0, along, 1.0)
    space = np.zeros((col.ROWS, col.STRIDE))
    for start in (col.A_X, col.B_Y, col.Z_Z):
        space[int(start) // col.STRIDE, 3] = 1.0
    space[int(col.O_X) // col.STRIDE, [0, 1, 2, 4, 5, 6, 7]] = 1e3
    first = int(col.V_X) // col.STRIDE
    space[first : first + 3, 3] = velocity
    law = ContactLaw(PROFILE, R, K, C, W, MU_S, MU_D, V_C, onset_s)
    damping = WITH_DAMPING if onset_s else None
    contact_columns(law, Candidates(points, 0, 0, 0, 1), space.ravel(), 0, col.LANES, damping, None)
    assert int(col.F_X) // col.STRIDE == col.FIRST_SUM
    sums = space[col.FIRST_SUM : col.LAST_SUM]
    assert np.all(sums[:, [0, 1, 2, 4, 5, 6, 7]] == 0.0), "columns do not mix"
    return tuple(sums[:, 3].tolist())


@pytest.mark.parametrize("share", [-0.6, -0.45, -0.2, 0.0, 0.3, 0.5, 2.0])
def test_coming_into_contact_is_averaged_over_its_time(share: float) -> None:
    """Spring and damper against their mean over the time about a moment when the point is `share` of it inside.

    What they do against the approach beyond the energy stored in a spring that is as deep as the point, is lost.
    """
    onset, rate = 1.5e-5, 0.6
    depth = share * rate * onset
    then = depth + rate * onset * (np.arange(20_000) + 0.5 - 10_000) / 20_000
    expected = np.where(then > 0, K * then + C * rate, 0.0).mean()
    f_x, *_, lost, _ = one_point(depth, (-rate, 0.0, 0.0), onset_s=onset)
    assert -f_x == pytest.approx(expected, rel=MEAN, abs=MEAN_N)
    assert lost == pytest.approx((expected - K * max(depth, 0.0)) * rate, rel=MEAN, abs=MEAN_N)
