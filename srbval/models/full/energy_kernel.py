"""Kernel: kinetic and potential energy of the full model's bodies."""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full import columns as col
from srbval.models.full.frames_kernel import cage_axes, cage_tilt, slot_axes
from srbval.models.full.state import state_indices
from srbval.models.jit import kernel


@kernel
def mechanical_energy(y, model):
    """Kinetic energy of rollers, cage and outer ring, and their energy in the field of gravity [J].

    T = sum over bodies of m v^2 / 2 + I omega^2 / 2; the shaft, whose motion is prescribed, is left out.
    """
    n = model.slot_angle.shape[0]
    at = state_indices(n)
    turn = y[at.cage + 2]
    omega_x, omega_y, omega_z = y[at.cage_rate], y[at.cage_rate + 1], y[at.cage_rate + 2]
    ct, st = math.cos(turn), math.sin(turn)
    axes = cage_axes(cage_tilt(y[at.cage], y[at.cage + 1]))
    along = omega_x * axes[6] + omega_y * axes[7] + omega_z * axes[8]
    square = omega_x * omega_x + omega_y * omega_y + omega_z * omega_z
    double = model.cage_transverse * square + (model.cage_axial - model.cage_transverse) * along * along
    double += model.ring_mass * (y[at.ring_rate] ** 2 + y[at.ring_rate + 1] ** 2 + y[at.ring_rate + 2] ** 2)
    height = model.ring_mass * y[at.ring + 1]
    space = model.scratch.space
    for j in range(n):
        slot = np.uint64(2 * j if j < n // 2 else 2 * j - n + 1)
        c = ct * space[col.SLOT_COSINE + slot] - st * space[col.SLOT_SINE + slot]
        s = st * space[col.SLOT_COSINE + slot] + ct * space[col.SLOT_SINE + slot]
        lean = space[col.SIDE + slot] * model.tilt_sine
        e_x, e_y, e_z, _, _, _, z_x, z_y, z_z = slot_axes(axes, c, s, model.tilt_cosine, lean)
        across = square - (omega_x * e_x + omega_y * e_y + omega_z * e_z) ** 2
        about = omega_x * z_x + omega_y * z_y + omega_z * z_z
        reach = model.centre_distance + y[at.slide + j]
        double += model.roller_mass * (y[at.slide_rate + j] ** 2 + reach * reach * across)
        double += model.roller_axial * y[at.spin + j] ** 2 + model.roller_transverse * (square - about * about)
        height += model.roller_mass * reach * e_y
    return 0.5 * double - model.gravity * height
