"""Kernel: contact forces and torques between the points of a race and barrel rollers.

All vectors are in the slot axes of a roller: x along its slot in the cage (outwards), y along the race, z along the
roller, origin at the roller's centre. The array `space` is described in `columns`; its column j is contact j, the
contact of one roller with one race.
"""

import math
from typing import NamedTuple

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.vectors_kernel import (
    add_vector,
    axes_at,
    cross,
    dot,
    plus,
    point_at,
    times,
    to_world,
    vector_at,
)
from srbval.models.jit import inlined, kernel_part

# A patch in three parts of equal load: mean of (x / half length)^2, weighted with the load, and half of its range.
MEAN_A, MEAN_B, MEAN_C = 0.016800224798641905, 0.12751682743387346, 0.45568294776748464
HALF_A, HALF_B, HALF_C = 0.025554662033143466, 0.09046373216412812, 0.38398160580272844

# Over a longer way a point's speed is not constant: with 5e-6, 1e-5 and 2e-5 m the rollers carry 2, 3 and 11 % too much
# at 3000 rpm; the noise floor at 710 rpm is 9.6e-4, 8.0e-4 and 5.7e-4 (2.5 s, interference, outer-race defect).
LONGEST_ONSET_M = 1e-5


class ContactLaw(NamedTuple):
    """Profile of the rollers, and constants of Giraudo's contact law (2025): force, eq. (18); friction, eq. (19)."""

    profile_radius: float  # of the roller's profile arc [m]
    roller_radius: float  # at the roller's middle [m]
    stiffness: float
    damping: float
    smoothing: float
    static_friction: float
    dynamic_friction: float
    critical_velocity: float
    onset_s: float  # time over which the onset of a point's contact is averaged, 0 without averaging


@kernel_part
def contact_columns(law, points, race, window, first, last, space, start, stop, damping, patch):
    """Add the contact forces of points on a race to columns `start` to `stop` - 1 of `space`.

    The points are the entries `first` to `last` - 1 of the list `window` in `points`, see `Races`. For each point:
    depth in the barrel roller in closed form, normal force by Giraudo's (2025) eq. (18), never a pull, friction by eq.
    (19). `patch`: None, or constants of the line model (see `columns`), in which a roller touches a race in three
    patches, side by side along the roller, and each point represents a whole patch.
    """
    begin, end = np.uint64(start), np.uint64(stop)
    table = points[race, window]
    for i in range(first, last):
        point, share = point_at(table, col.POINT_RADIAL, i), table[col.POINT_SHARE, i]
        for j in range(begin, end):
            place = place_of_point(point, space, j)
            depth, normal = penetration(law, place)
            u_n, slip = approach_and_slip(place, normal, space, j)
            if patch is None:
                spring, viscous, elastic = point_spring_and_damper(law, depth, u_n, share, damping)
                pressure = normal_force(spring, viscous, u_n)
                drag, friction, loss = point_friction(law, pressure, slip)
                twice_energy = spring * depth
            else:
                deep = depth if depth > 0.0 else 0.0
                root = math.sqrt(deep)
                spring = patch[race, i, col.PATCH_STIFFNESS] * deep * root
                viscous = patch[race, i, col.PATCH_DAMPING] * root
                pressure = normal_force(spring, viscous, u_n)
                turning = vector_at(space, col.W_X, j)
                rise = times(patch[race, i, col.PATCH_SLIP_SPREAD] * deep, cross(turning, normal))
                pivot = dot(turning, normal)
                pivot *= pivot * patch[race, i, col.PATCH_LENGTH] * deep
                drag, friction, loss = patch_friction(law, pressure, slip, rise, pivot)
                elastic, twice_energy = spring, 0.8 * spring * deep
            add_contact(place, normal, pressure, friction, space, j)
            space[col.FRICTION_LOSS + j] += loss
            space[col.DAMPING_LOSS + j] += (elastic - pressure) * u_n
            space[col.TWICE_ENERGY + j] += twice_energy
            if damping is not None:
                viscous = viscous if pressure > 0.0 else 0.0
                add_damping(viscous, drag, place, normal, space, j)


@inlined
def place_of_point(point, space, j):
    """Convert a race's `point` (radial, tangential, axial) to its place relative to the roller in contact `j` [m]."""
    return plus(vector_at(space, col.O_X, j), 1.0, to_world(point, axes_at(space, col.A_X, j)))


@inlined
def approach_and_slip(place, normal, space, j):
    """Compute the race's velocity relative to the roller of contact `j` at `place` [m/s]: normal part, slip vector."""
    velocity = plus(vector_at(space, col.V_X, j), 1.0, cross(vector_at(space, col.W_X, j), place))
    u_n = dot(velocity, normal)
    return u_n, plus(velocity, -u_n, normal)


@inlined
def add_contact(place, normal, pressure, friction, space, j):
    """Add normal force `pressure` and `friction` [N] at `place` to force and torque on the roller of contact `j`."""
    force = plus(friction, -pressure, normal)
    add_vector(space, col.F_X, j, force)
    add_vector(space, col.T_X, j, cross(place, force))


@inlined
def penetration(law, place):
    """Compute the depth of a point below a roller's barrel surface [m] and the surface's normal there, outwards."""
    p_x, p_y, p_z = place
    rho = math.sqrt(p_x * p_x + p_y * p_y)
    s = rho + (law.profile_radius - law.roller_radius)
    distance = math.sqrt(s * s + p_z * p_z)
    inverse = 1.0 / (distance * rho)
    return law.profile_radius - distance, (s * inverse * p_x, s * inverse * p_y, rho * inverse * p_z)


@inlined
def point_spring_and_damper(law, depth, u_n, share, damping):
    """Compute spring force [N], damping coefficient [N s/m] and elastic force [N] of a point on a race's surface.

    `depth` of the point in the roller [m]; `u_n`: speed of separation [m/s]; `share`: fraction of the law's stiffness
    and damping that the point has, below 1 where a defect has finer points; `damping`: None for explicit time steps,
    any other value for implicit steps. In explicit steps, spring force and damper rise over the depth
    ``law.smoothing``, as in eq. (18) of Giraudo (2025). A point crosses that depth in nanoseconds, so that the damper's
    force, some 600 N, jumps in the first step that finds the point in contact. In implicit steps, spring and damper of
    an approaching point are therefore averaged over a distance: the travel of the point in the time ``law.onset_s``, at
    most `LONGEST_ONSET_M`. A retreating point loses contact when the damper's pull equals the spring's push, without a
    jump. The elastic force is the spring force without averaging.
    """
    if damping is not None:
        travel = -law.onset_s * u_n if u_n < 0.0 else 0.0
        travel = travel if travel < LONGEST_ONSET_M else LONGEST_ONSET_M
        lead = depth + 0.5 * travel
        x = lead / (travel + law.smoothing)
        x = x if x > 0.0 else 0.0
        x = x if x < 1.0 else 1.0
        smooth = share * x
        spring = smooth * law.stiffness * (lead - 0.5 * x * travel)
        elastic = share * law.stiffness * (depth if depth > 0.0 else 0.0)
    else:
        x = depth * (1.0 / law.smoothing)
        x = x if x > 0.0 else 0.0
        x = x if x < 1.0 else 1.0
        smooth = share * x * x * (3.0 - 2.0 * x)
        spring = elastic = smooth * law.stiffness * depth
    return spring, smooth * law.damping, elastic


@inlined
def normal_force(spring, viscous, u_n):
    """Compute a normal force [N], never negative: `spring` minus damper `viscous` at the speed of separation `u_n`."""
    normal = spring - viscous * u_n
    return normal if normal > 0.0 else 0.0


@inlined
def point_friction(law, pressure, slip):
    """Compute friction at a `slip` velocity, Giraudo's eq. (19): force over slip [N s/m], force [N], lost power."""
    static, dynamic, critical = law.static_friction, law.dynamic_friction, law.critical_velocity
    at_rest = static / critical  # coefficient of friction over slip
    fall = (static - dynamic) / (0.5 * critical)
    square = dot(slip, slip)
    speed = math.sqrt(square) + 1e-300
    mu = static - fall * (speed - critical)
    mu = mu if mu > dynamic else dynamic
    mu = mu / speed
    mu = mu if mu < at_rest else at_rest
    drag = mu * pressure
    return drag, times(drag, slip), drag * square


@inlined
def patch_friction(law, pressure, slip, rise, pivot):
    """Compute the friction of a patch of the line model under the load `pressure` [N]; result: see `point_friction`.

    The patch has three parts of equal load; other arguments as in `part_friction`.
    """
    reach = dot(rise, rise)
    third = pressure * (1.0 / 3.0)
    drag_a = part_friction(law, slip, rise, reach, pivot, MEAN_A, HALF_A, third)
    drag_b = part_friction(law, slip, rise, reach, pivot, MEAN_B, HALF_B, third)
    drag_c = part_friction(law, slip, rise, reach, pivot, MEAN_C, HALF_C, third)
    drag = drag_a + drag_b + drag_c
    friction = plus(times(drag, slip), drag_a * MEAN_A + drag_b * MEAN_B + drag_c * MEAN_C, rise)
    return drag, friction, dot(friction, slip)


@kernel_part
def part_friction(law, slip, rise, reach, pivot, mean, half, normal):
    """Compute friction force divided by slip speed [N s/m] for one part of a contact patch with load `normal` [N].

    At the distance x from the patch's middle, X is (x / half length of the patch)^2. In this part, X ranges from `mean`
    - `half` to `mean` + `half`. The slip velocity is q + X e [m/s]: q = `slip` in the middle of the patch, q + e at its
    ends, e = `rise`; `reach` is the square of e. If the race turns about the contact's normal, a slip at right angles
    to q + X e is added; the square of this added slip is X times `pivot`. Giraudo's eq. (19) is averaged over the part
    approximately: its critical velocity is raised to at least `half` times the length of e.
    """
    middle = plus(slip, mean, rise)
    across = pivot * mean
    speed = math.sqrt(dot(middle, middle) + across) + 1e-300
    own, range_ = law.critical_velocity * law.critical_velocity, reach * half * half
    critical = math.sqrt((own if own > range_ else range_) + across)
    inverse = 1.0 / (speed * critical)  # one division serves both
    per_slip, per_critical = critical * inverse, speed * inverse
    dynamic = law.dynamic_friction
    excess = (law.static_friction - dynamic) * law.critical_velocity * per_critical
    mu = dynamic + excess * (3.0 - 2.0 * speed * per_critical)
    mu = (mu if mu > dynamic else dynamic) * per_slip
    most = (dynamic + excess) * per_critical
    mu = mu if mu < most else most
    return mu * normal


@inlined
def add_damping(viscous, drag, place, normal, space, j):
    """Add a point's damping [N s/m], `viscous` along the normal, `drag` across it, to the matrix of contact `j`."""
    p_x, p_y, p_z = place
    n_x, n_y, n_z = normal
    along_normal = viscous - drag
    arm = n_x * p_z - n_z * p_x
    l_x, l_y, l_z = along_normal * n_x, along_normal * n_y, along_normal * n_z
    space[col.D_XX + j] += drag + l_x * n_x
    space[col.D_XY + j] += l_x * n_y
    space[col.D_XZ + j] += l_x * n_z
    space[col.D_YY + j] += drag + l_y * n_y
    space[col.D_YZ + j] += l_y * n_z
    space[col.D_ZZ + j] += drag + l_z * n_z
    space[col.D_XP + j] += drag * p_z + l_x * arm
    space[col.D_YP + j] += l_y * arm
    space[col.D_ZP + j] += l_z * arm - drag * p_x
    space[col.D_PP + j] += drag * (p_z * p_z + p_x * p_x) + along_normal * arm * arm
    space[col.D_XS + j] -= drag * p_y
    space[col.D_YS + j] += drag * p_x
    space[col.D_PS + j] -= drag * p_y * p_z
    space[col.D_SS + j] += drag * (p_x * p_x + p_y * p_y)


@kernel_part
def with_friction(law, damping, static, dynamic, critical):
    """Copy the contact law with other damping [N s/m], coefficients of friction and `critical` slip speed [m/s]."""
    profile, roller = law.profile_radius, law.roller_radius
    return ContactLaw(profile, roller, law.stiffness, damping, law.smoothing, static, dynamic, critical, law.onset_s)
