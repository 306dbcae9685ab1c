"""Layout of the kernels' working space: a place for each roller, and a column for each roller against each race.

The kernels work on eight places at a time, so each quantity is a row of one flat array, a fixed stride apart. Rollers
stand in the order of their slot angles, both rows in turn (row 1, row 2, row 1, ...), filled up to a multiple of eight:
a load zone is a run of neighbours, and eights that it leaves out are skipped. The roller at place p meets the outer
race in column p and the inner one in column ``RACE + p``; a column with points of its own (a defect near, a damaged
roller) is copied to ``ALONE`` or behind, eight places apart, and worked on alone.

Row 2 is row 1 mirrored at the mid-plane: its columns' shaft axes are turned round, and its points are row 1's.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

AT_ONCE = 8  # places the processor works on together
RACE, MOVED, ALONE = 104, 208, 416  # known to the compiler, so that it sees that columns do not overlap
CACHE_LINE = 64

# Not a multiple of a power of two: rows a page apart would all fall into the same few lines of the cache.
STRIDE = 2056
(
    A_X, A_Y, A_Z,  # meridian of the nearest point, in slot axes
    B_X, B_Y, B_Z,  # along the race
    Z_X, Z_Y, Z_Z,  # shaft, away from the mid-plane
    O_X, O_Y, O_Z,  # ring's centre less the roller's [m]
    V_X, V_Y, V_Z,  # velocity of the ring less the roller's, at the roller's centre [m/s]
    W_X, W_Y, W_Z,  # angular velocity of the ring less the roller's [rad/s]
    F_X, F_Y, F_Z,  # sum: force on the roller [N]
    T_X, T_Y, T_Z,  # sum: torque on the roller about its centre [N m]
    RUBBED, DAMPED,  # sums: power lost to friction, to damping [W]
    STORED,  # sum: twice the elastic energy [J]
    # sums: force and torque against V and W_Y, W_Z, see `damping_kernel`
    D_XX, D_XY, D_XZ, D_YY, D_YZ, D_ZZ, D_XP, D_YP, D_ZP, D_PP, D_XS, D_YS, D_PS, D_SS,
    PLACE,  # where the roller stands among the race's points: index of a point, with its fraction
    SHIFT,  # 0.5: windows about the nearest point; 0: about the one before
    TOUCHED,  # how many points of each circle it may touch, no less
    NEED,  # the same as `need_of` codes it, to be added up
    DEPTH, BOUND,  # penetration at the middle of the profile; what no point of an undamaged race exceeds [m]
    # for each roller: constants, what is read from the state, slot axes in world coordinates, what is found
    SIDE, SLOT_ANGLE, SLOT_COSINE, SLOT_SINE, DAMAGE,  # side: +1 for row 1 (z > 0), -1 for row 2; 0: nobody here
    SLIDE, SLIDE_RATE, SPIN,
    X_WX, X_WY, X_WZ, Y_WX, Y_WY, Y_WZ, Z_WX, Z_WY, Z_WZ,  # slot axes x, y, z, by world components
    CAGE_X, CAGE_Y, CAGE_Z,  # cage's angular velocity [rad/s]
    M_X, M_Y, M_Z, N_X, N_Y, N_Z,  # the slot's meridian and the direction along the race, in slot axes
    SLIDE_RISE, SPIN_RISE,  # accelerations [m/s2], [rad/s2]
    # a roller's own equations solved for it, and how its slide and spin follow cage and ring, see `damping_kernel`
    OWN_UU, OWN_US, OWN_SS, U_WY, U_WZ, U_RX, U_RY, U_RZ, S_WY, S_WZ, S_RX, S_RY, S_RZ,
) = (np.uint64(i * STRIDE) for i in range(88))  # fmt: skip
ROWS = 88
FRAME = range(18)  # rows that set up a column
SUMS = range(18, 27)  # of force, torque and energy
DAMPING_SUMS = range(27, 41)


def aligned_zeros(size: int) -> NDArray[np.float64]:
    """Zeros, shape [size], that begin on a line of the cache, so that no eight places straddle two."""
    per_line = CACHE_LINE // 8
    whole = np.zeros(size + per_line)
    skipped = -whole.ctypes.data % CACHE_LINE // 8
    return whole[skipped : skipped + size]
