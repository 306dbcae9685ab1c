"""Mass and damping matrix of the full model in its generalised speeds, from partial velocities in world axes.

Dense, [S, S] for S speeds in the order of the state: slides, spins, cage, ring, a second cage's lead. No slot frame, no
block, no elimination: every body and every touching point adds its own square form.
"""

from typing import NamedTuple

import numpy as np

from tests.verification.harness import FloatArray, layout_of
from tests.verification.world import World


class Partial(NamedTuple):
    """Velocity of each roller's centre and its angular velocity per unit of each speed, [S, 2 M, 3]; `ring`, [S, 3]."""

    centre: FloatArray
    omega: FloatArray
    ring: FloatArray


def partial_velocities(world: World, y: FloatArray) -> Partial:
    where, slots, centres = layout_of(y), world.slots(y), world.centres(y)
    n = where.rollers
    rollers, axis = np.arange(n), slots[:, :, 2]
    centre, omega, ring = np.zeros((where.half, n, 3)), np.zeros((where.half, n, 3)), np.zeros((where.half, 3))
    centre[rollers, rollers] = slots[:, :, 0]
    omega[n + rollers, rollers] = axis
    for k, unit in enumerate(np.eye(3)):
        centre[2 * n + k] = np.cross(unit, centres)
        omega[2 * n + k] = unit - (axis @ unit)[:, None] * axis
        ring[2 * n + 3 + k] = unit
    if where.half > 2 * n + 6:  # row 2's cage turns about the same axis
        second, about = world.side < 0, world.cage_axis(y)
        centre[-1, second] = np.cross(about, centres[second])
        omega[-1, second] = about - (axis[second] @ about)[:, None] * axis[second]
    return Partial(centre, omega, ring)


def mass_matrix(world: World, y: FloatArray) -> FloatArray:
    where, p, b = layout_of(y), partial_velocities(world, y), world.bodies
    slots, axis = world.slots(y), world.cage_axis(y)
    top = np.array([b.roller_transverse, b.roller_transverse, b.roller_axial])
    own = np.einsum("jax,x,jbx->jab", slots, top, slots)
    mass = b.roller * np.einsum("kja,lja->kl", p.centre, p.centre) + b.ring * p.ring @ p.ring.T
    mass += np.einsum("kja,jab,ljb->kl", p.omega, own, p.omega)
    mass[where.cage, where.cage] += b.cage_axial / 2 * (np.eye(3) + np.outer(axis, axis))
    mass[where.relative_angle, where.relative_angle] += b.cage_axial / 2
    mass[where.cage, where.relative_angle] += b.cage_axial / 2 * axis[:, None]
    mass[where.relative_angle, where.cage] += b.cage_axial / 2 * axis
    return mass


def damping_with_shaft(world: World, t: float, y: FloatArray, *, about_slot: bool = False) -> FloatArray:
    """Sum over touching points of G' C G, C = drag (1 - n n) + damper n n, and the housing's damper, [S + 1, S + 1].

    The last speed is the shaft's. `about_slot`: count in that the cage turns rollers about their slots, which the model
    leaves out.
    """
    where, p = layout_of(y), partial_velocities(world, y)
    slot, centres, along = world.slots(y)[:, :, 0], world.centres(y), np.array([0.0, 0.0, 1.0])
    # the shaft's material at the rollers
    omega = np.concatenate([-p.omega, np.broadcast_to(along, (1, where.rollers, 3))])
    centre = np.concatenate([-p.centre, np.cross(along, centres)[None]])
    if not about_slot:
        omega = omega - (omega * slot).sum(axis=2)[:, :, None] * slot
    damping = np.zeros((where.half + 1, where.half + 1))
    damping[where.ring, where.ring] = world.scene.housing.damping_ns_m * np.eye(3)
    for race in (0, 1):
        at = world.touching(t, y, race)
        past = centre[:, at.roller] + np.cross(omega[:, at.roller], at.arm)
        if race == 0:
            past[:-1] += p.ring[:, None, :]
            past[-1] = 0.0
        closing = (past * at.normal).sum(axis=2)
        damping += np.einsum("kia,i,lia->kl", past, at.drag, past, optimize=True)
        damping += np.einsum("ki,i,li->kl", closing, at.damper - at.drag, closing, optimize=True)
    return damping
