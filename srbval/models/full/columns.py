"""Layout of the full model's state vector, and of the arrays that its compiled functions (kernels) share.

Kernels import this module as ``col``; the compiler replaces each name by its value.

**Workspace** (the flat array `space`): each quantity has a row of `STRIDE` entries; the name of the quantity is the
index of the row's first entry. A *slot* is the place of one roller, a *column* is the contact of one roller with one
race: the roller in slot p meets the outer race in column p and the inner race in column ``RACE + p``. Contact forces
act at *race points*, points on a race's surface; a list contains the points that a roller may touch. The processor
computes `LANES` neighbouring columns, a *lane group*, at a time, all with the same list. Rollers are sorted by slot
angle, with the bearing's two rows alternating, and padded to whole lane groups: loaded rollers are then neighbours, and
lane groups without contact are skipped. A column that needs more points than the list of its lane group has is copied
to another group, from column `COMPACTED` on. A column with a list of its own (near a defect, or of a damaged roller) is
copied to a group of its own, from column `SINGLE` on.

Bearing row 2 mirrors row 1: it uses the race points of row 1, with the direction of the shaft's axis (rows `Z_X`, `Z_Y`
and `Z_Z`) reversed.

**Arguments** that kernels share: `model`: `Parameters`, with its fields `space` and `plan`; `y`: state; `at`: its
`StateIndices`; `slots`: number of slots, rounded up to whole lane groups; `half`: rollers in a row; `rotation` of the
rollers about their axes, relative to the cage [rad]; `shaft`, `shaft_angle`: speed [rad/s] and angle [rad] of the
shaft; `cage`: speed of row 1's cage [rad/s]; `race`: 0 outer, 1 inner; `count`: points on a circle of a race; `groups`,
`compacted`, `single`: numbers of lane groups, of compacted and of single columns in the plan; `damping`:
`motion_kernel.WITH_DAMPING` if the damping matrices of the contacts are needed, for an implicit step, otherwise None.
"""

import itertools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from srbval.models.jit import kernel_part

LANES = 8  # slots the processor works on together
RACE, COMPACTED, SINGLE = 104, 208, 416  # constants, so that the compiler knows that columns do not overlap
INNER = np.uint64(RACE)
CACHE_LINE = 64  # bytes
FAR_M = 1e3  # coordinate of unused points and columns, out of reach of every roller

# Not a multiple of a power of two: rows a page apart would all use the same few lines of the cache.
STRIDE = 2056
(
    # axes of the race at a column, in slot axes: radially outwards at its list of points, along the race there, and
    # along the shaft, away from the mid-plane
    A_X, A_Y, A_Z, B_X, B_Y, B_Z, Z_X, Z_Y, Z_Z,
    O_X, O_Y, O_Z,  # ring's centre less roller's centre [m]
    V_X, V_Y, V_Z,  # velocity of the ring relative to the roller, at the roller's centre [m/s]
    W_X, W_Y, W_Z,  # angular velocity of the ring relative to the roller [rad/s]
    F_X, F_Y, F_Z,  # sum: force on the roller [N]
    T_X, T_Y, T_Z,  # sum: torque on the roller about its centre [N m]
    FRICTION_LOSS, DAMPING_LOSS,  # sums: power lost to friction, to contact damping [W]
    TWICE_ENERGY,  # sum: twice the elastic energy [J]
    # sums: secant damping matrix of force and torque against V and W_Y, W_Z, see `damping_kernel`
    D_XX, D_XY, D_XZ, D_YY, D_YZ, D_ZZ, D_XP, D_YP, D_ZP, D_PP, D_XS, D_YS, D_PS, D_SS,
    POSITION,  # of the roller among the race's points: index of a point, with its fraction
    SHIFT,  # 0.5: list of points about the point nearest to the roller; 0: about the point before the roller
    CANDIDATES,  # upper bound for the number of points of each circle in contact
    CANDIDATE_CODE,  # see `candidate_code`; summed over a lane group
    MIDDLE_DEPTH, DEPTH_BOUND,  # penetration at the middle of the profile; largest at any point of a sound race [m]
    # for each roller: constants, parts of the state, slot axes in world coordinates, accelerations
    SIDE, SLOT_ANGLE, SLOT_COSINE, SLOT_SINE,  # side: +1 for row 1 (z > 0), -1 for row 2; 0: an empty slot
    DAMAGE,  # also for a column: summed height of the roller's defects that may meet the race [m]
    SLIDE, SLIDE_RATE, SPIN,
    X_WX, X_WY, X_WZ, Y_WX, Y_WY, Y_WZ, Z_WX, Z_WY, Z_WZ,  # slot axes x, y, z, by world components
    CAGE_X, CAGE_Y, CAGE_Z,  # cage's angular velocity [rad/s]
    M_X, M_Y, M_Z, N_X, N_Y, N_Z,  # the slot's meridian and the direction along the race, in slot axes
    SLIDE_ACCELERATION, SPIN_ACCELERATION,  # [m/s2], [rad/s2]
    # inverse of a roller's own block, and how its slide and spin follow cage and ring, see `damping_kernel`
    OWN_UU, OWN_US, OWN_SS, U_WY, U_WZ, U_RX, U_RY, U_RZ, S_WY, S_WZ, S_RX, S_RY, S_RZ,
    SHAFT_U, SHAFT_S,  # damping torque on the shaft per slide [N s] and per spin [N m s], see `damping_kernel`
    ON_CAGE,  # couple on the cage about its roller's axis, of the oil's drag and its pocket [N m], see `oil_kernel`
    # roller that tilts: cosine, sine, displacement along its axis [m], skew moment, and its couple on the cage about
    # the slot's z [N m], see `tilt_kernel`
    TILT_COSINE, TILT_SINE, SHIFT_ALONG, SKEW_MOMENT, SKEW_ON_CAGE,
) = (np.uint64(i * STRIDE) for i in range(96))  # fmt: skip
WORKSPACE_ROWS = 96
FACED_ROWS = 6  # rows of A and B, which are turned to the list of points (window) of a column
FRAME_ROWS = 18  # rows with the geometry and motion of a column
FIRST_SUM, LAST_SUM, LAST_DAMPING_SUM = 18, 27, 41  # sums of force, torque and energy, then of damping

# Candidate points of a race (`points`): position and surface normal in the frame of the window's meridian [m], and the
# share of K_c and C_c.
POINT_RADIAL, POINT_TANGENTIAL, POINT_AXIAL, POINT_SHARE, NORMAL_RADIAL, NORMAL_TANGENTIAL, NORMAL_AXIAL = range(7)
POINT_ROWS = 7

# Plan of a search (`plan`), one row for each of three kinds of entry, see `search_kernel`.
GROUP_ROWS = 64  # rows for lane groups, compacted groups included: more than can occur
FIRST_COPY = GROUP_ROWS  # rows for the compacted columns
FIRST_SINGLE = FIRST_COPY + 2 * RACE + 2  # rows for the single columns
GROUP_RACE, GROUP_WINDOW, GROUP_FIRST, GROUP_END = range(4)  # end: last column of the group + 1
COPY_FROM, COPY_TO, COPY_POINTS = range(3)
SINGLE_RACE, SINGLE_WINDOW, SINGLE_FROM, SINGLE_BASE = range(4)  # base: window of the race with the original points

# Defects of the rollers (`roller_defects`): number of the roller, angle about its axis [rad], position along it [m],
# height [m], extent [m].
DEFECT_ROLLER, DEFECT_ANGLE, DEFECT_AXIAL, DEFECT_HEIGHT, DEFECT_EXTENT = range(5)
DEFECT_COLUMNS = 5

# Continuous contact of a circle (`patch`), see `srbval.models.line`: force over d^(3/2), damper over d^(1/2), spread of
# the slip over W d, square of the patch's half length over d.
PATCH_STIFFNESS, PATCH_DAMPING, PATCH_SLIP_SPREAD, PATCH_LENGTH = range(4)

# Slices of a contact (`SliceTable.rows`), see `slices_kernel`: place and surface normal in the roller's meridian;
# force over e^(10/9), width, least spread of the penetration, depth of the barrel's mean below its middle,
# curvature of the gap along the roller times the width squared; then of a defect of the race there: half its length
# along the race, depth of its floor, length of its ramps, and half the curvature of the gap along the race.
(
    SLICE_RADIAL, SLICE_AXIAL, SLICE_NORMAL_RADIAL, SLICE_NORMAL_AXIAL,
    SLICE_STIFFNESS, SLICE_WIDTH, SLICE_VERTEX, SLICE_LIFT, SLICE_BEND,
    SLICE_HALF, SLICE_FLOOR, SLICE_RAMP, SLICE_SAG,
) = range(13)  # fmt: skip
SLICE_ROWS = 13

# Totals of an evaluation of the right-hand side (`totals`).
(
    RING_FORCE_X, RING_FORCE_Y, RING_FORCE_Z,  # force of the rollers on the outer ring [N]
    DEEPEST,  # deepest penetration into an undamaged race [m]
    SHAFT_TORQUE,  # of the rollers on the shaft about its axis [N m]
    CONTACT_ENERGY,  # elastic energy in the contacts [J]
    # powers in the order of `outputs`: of the drive, of the external load; lost to friction, to contact damping, in the
    # housing's damper [W]
    DRIVE_POWER, LOAD_POWER, FRICTION_POWER, DAMPING_POWER, HOUSING_POWER,
    INERTIA_XX, INERTIA_YY, INERTIA_ZZ,  # of the cage with its rollers about the bearing centre [kg m2]
    INERTIA_XY, INERTIA_XZ, INERTIA_YZ,
    RELATIVE_X, RELATIVE_Y, RELATIVE_Z, RELATIVE_AXIAL,  # of row 2 about the second cage: coupling and own value
    ROLLING_POWER, DRAG_POWER, POCKET_POWER,  # lost to rolling resistance, the oil's drag, friction of pockets [W]
) = range(24)  # fmt: skip
TOTALS = 24
# Rows of `factors` behind the border of cages and ring: coupling of the border with a second cage's relative rate,
# the solution for this coupling, and the inverse of the remaining diagonal entry; damping torque on the shaft per rate
# of the cage and per relative rate [N m s].
RELATIVE_BORDER, RELATIVE_FOLLOWED, RELATIVE_OWN, SHAFT_ROW = 6, 7, 8, 9
FACTOR_ROWS = 10
RING_FORCE = slice(0, 3)

# State vector, see the table at `srbval.models.full`.
CAGE_AND_RING = 6  # coordinates besides the rollers': three gimbal angles, three displacements


class StateIndices(NamedTuple):
    """Index of the first entry of each part of a state vector; the velocities begin with `slide_rate`.

    `relative_angle` and `relative_rate` belong to a second cage; with one cage they are the indices at which the next
    part would begin.
    """

    slide: int
    rotation: int
    cage: int
    ring: int
    relative_angle: int
    slide_rate: int
    spin: int
    cage_rate: int
    ring_rate: int
    relative_rate: int


def indices_of(size: int) -> StateIndices:
    """Compute the `StateIndices` of a state vector with `size` entries."""
    half = size // 2
    rollers = (half - CAGE_AND_RING) // 2
    cage = 2 * rollers
    return StateIndices(
        0, rollers, cage, cage + 3, cage + 6, half, half + rollers, half + cage, half + cage + 3, half + cage + 6
    )


state_indices = kernel_part(indices_of)  # for kernels


class StateLayout:
    """Slices of the parts of a state vector: ``y[layout.ring]`` is the outer ring's displacement.

    `half` is the number of coordinates, and of the velocities that follow them; `parts` lists all slices that are not
    empty, `velocities` the slices of velocities among these; `shaft_cage_rate` is the cage's angular velocity about the
    shaft's axis. `relative_angle` and `relative_rate` belong to a second cage; with one cage they are empty.
    """

    def __init__(self, size: int) -> None:
        parts = [slice(*ends) for ends in itertools.pairwise((*indices_of(size), size))]
        self.rollers, self.half = parts[1].start, size // 2
        self.slide, self.rotation, self.cage, self.ring, self.relative_angle = parts[:5]
        self.slide_rate, self.spin, self.cage_rate, self.ring_rate, self.relative_rate = parts[5:]
        self.parts = [part for part in parts if part.start < part.stop]
        self.velocities = [part for part in self.parts if part.start >= self.half]
        self.shaft_cage_rate = slice(self.ring_rate.start - 1, self.ring_rate.start)


def layout_of(state: NDArray[np.float64]) -> StateLayout:
    """Compute the `StateLayout` of a state vector."""
    return StateLayout(len(state))
