"""Kernel: kinetic and potential energy of the full model's bodies."""

from __future__ import annotations

import math

import numpy as np

from srbval.models.full.columns import SIDE, SLOT_COSINE, SLOT_SINE
from srbval.models.jit import kernel


@kernel
def mechanical_energy(y, model):
    """Kinetic energy of rollers, cage and outer ring, and their energy in the field of gravity [J].

    T = sum over bodies of m v^2 / 2 + I omega^2 / 2; the shaft, whose motion is prescribed, is left out.
    """
    n = model.slot_angle.shape[0]
    d = 2 * n + 6
    tilt_x, tilt_y, turn = y[2 * n], y[2 * n + 1], y[2 * n + 2]
    omega_x, omega_y, omega_z = y[d + 2 * n], y[d + 2 * n + 1], y[d + 2 * n + 2]
    ca, sa = math.cos(tilt_x), math.sin(tilt_x)
    cb, sb = math.cos(tilt_y), math.sin(tilt_y)
    ct, st = math.cos(turn), math.sin(turn)
    axis_x, axis_y, axis_z = sb, -sa * cb, ca * cb
    along = omega_x * axis_x + omega_y * axis_y + omega_z * axis_z
    square = omega_x * omega_x + omega_y * omega_y + omega_z * omega_z
    double = model.cage_transverse * square + (model.cage_axial - model.cage_transverse) * along * along
    double += model.ring_mass * (y[2 * d - 3] ** 2 + y[2 * d - 2] ** 2 + y[2 * d - 1] ** 2)
    height = model.ring_mass * y[2 * n + 4]
    space = model.scratch.space
    for j in range(n):
        place = np.uint64(2 * j if j < n // 2 else 2 * j - n + 1)
        c = ct * space[SLOT_COSINE + place] - st * space[SLOT_SINE + place]
        s = st * space[SLOT_COSINE + place] + ct * space[SLOT_SINE + place]
        x, v, w = model.tilt_cosine * c, model.tilt_cosine * s, space[SIDE + place] * model.tilt_sine
        e_x, e_y, e_z = cb * x + sb * w, sa * sb * x + ca * v - sa * cb * w, -ca * sb * x + sa * v + ca * cb * w
        t_x, t_y, t_z = -cb * s, -sa * sb * s + ca * c, ca * sb * s + sa * c
        z_x, z_y, z_z = e_y * t_z - e_z * t_y, e_z * t_x - e_x * t_z, e_x * t_y - e_y * t_x
        across = square - (omega_x * e_x + omega_y * e_y + omega_z * e_z) ** 2
        about = omega_x * z_x + omega_y * z_y + omega_z * z_z
        reach = model.centre_distance + y[j]
        double += model.roller_mass * (y[d + j] ** 2 + reach * reach * across)
        double += model.roller_axial * y[d + n + j] ** 2 + model.roller_transverse * (square - about * about)
        height += model.roller_mass * reach * e_y
    return 0.5 * double - model.gravity * height
