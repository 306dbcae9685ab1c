"""Layout of the kernels' working space: one column for each roller that may touch a race, one place for each roller.

The contact kernel works on eight columns at a time, so what it reads and writes of a column stands in rows of one flat
array, `STRIDE` apart: the frame and velocities of the roller against the race, then the sums it adds up. Columns
that look at the same candidate points stand together in a group of their own: by race, row, and narrow or wide window;
those with points of their own (a defect near, a damaged roller) stand alone, eight places apart.
"""

from __future__ import annotations

import numpy as np

# Not a multiple of a power of two: rows a page apart would all fall into the same few lines of the cache.
STRIDE = 2056
GROUPS = 8  # race, row, narrow or wide
AT_ONCE = 8  # columns the processor works on together; groups are filled up to a multiple

(
    A_X, A_Y, A_Z,  # meridian of the nearest point, in slot axes
    B_X, B_Y, B_Z,  # along the race
    Z_X, Z_Y, Z_Z,  # shaft
    O_X, O_Y, O_Z,  # ring's centre less the roller's [m]
    V_X, V_Y, V_Z,  # velocity of the ring less the roller's, at the roller's centre [m/s]
    W_X, W_Y, W_Z,  # angular velocity of the ring less the roller's [rad/s]
    F_X, F_Y, F_Z,  # sum: force on the roller [N]
    T_X, T_Y, T_Z,  # sum: torque on the roller about its centre [N m]
    RUBBED, DAMPED,  # sums: power lost to friction, to damping [W]
    STORED,  # sum: twice the elastic energy [J]
) = (np.uint64(i * STRIDE) for i in range(27))  # fmt: skip
ROWS = 27

# One place for each roller, rows `ROLLERS` apart: slot axes in world coordinates, the cage's angular velocity in them,
# how each race moves against the roller, bounds of the penetration, and the sums over both races.
ROLLERS = 104
(
    X_WX, X_WY, X_WZ, Y_WX, Y_WY, Y_WZ, Z_WX, Z_WY, Z_WZ,  # slot axes x, y, z, by world components
    CAGE_X, CAGE_Y, CAGE_Z,  # cage's angular velocity [rad/s]
    OUTER_X, OUTER_Y, OUTER_Z,  # outer ring's centre less the roller's [m]
    OUTER_VX, OUTER_VY, OUTER_VZ, INNER_VX, INNER_VY, INNER_VZ,  # ring's velocity less the roller's [m/s]
    INNER_WX, INNER_WY, INNER_WZ,  # inner ring's angular velocity less the roller's [rad/s]
    OUTER_DEPTH, INNER_DEPTH,  # penetration at the middle of the profile [m]
    OUTER_OFFSET, INNER_OFFSET,  # what the profiles' centres stand apart along the roller's axis [m]
    FORCE_X, FORCE_Y, FORCE_Z, TORQUE_X, TORQUE_Y, TORQUE_Z,  # sums over both races [N], [N m]
) = (np.uint64(i * ROLLERS) for i in range(34))  # fmt: skip
ROLLER_ROWS = 34
