"""Tables of the heights around races and rollers, as their contacts feel them."""

import math

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import SphericalRollerGeometry
from srbval.models.full.frames_kernel import SurfaceHeights
from srbval.models.full.point_cloud import inner_circle, outer_circle
from srbval.scene import Scene

YOUNG_N_M2, POISSON = 2.07e11, 0.3  # bearing steel, ISO/TS 16281
POINTS_OF_A_WAVE = 16  # of the shortest; straight lines between them miss it by 2 %
MOST_LOADED = 5.0  # times the mean load along the force: of a bearing with clearance, after Stribeck; from memory


def surface_heights(scene: Scene, geometry: SphericalRollerGeometry, roller_m: float) -> SurfaceHeights:
    """Tables for both races, in the middle of their contacts, and all rollers, of `roller_m` radius.

    Without a surface they are empty.
    """
    surface, rollers = scene.surface, 2 * geometry.rollers_per_row
    if surface is None:
        return SurfaceHeights(np.zeros((2, 2, 0)), np.zeros((rollers, 0)))
    circles = outer_circle(geometry, 1.0), inner_circle(geometry, 1.0)
    load_n = MOST_LOADED * scene.mean_radial_n / (rollers * math.cos(geometry.tilt_rad))
    outer_half_m, inner_half_m = (
        contact_half_m(load_n / geometry.roller_width_m, 1 / roller_m + circle.normal_radial / circle.radius_m)
        for circle in circles
    )
    bodies = (
        (circles[0].radius_m, outer_half_m, 2),
        (circles[1].radius_m, inner_half_m, 2),
        (roller_m, (outer_half_m + inner_half_m) / 2, rollers),
    )
    draw, found = np.random.default_rng(scene.seed), []
    for (radius_m, half_m, count), given_m in zip(bodies, surface.given_m, strict=True):
        orders = surface.orders(2 * math.pi * radius_m)
        felt = surface.amplitudes(2 * math.pi * radius_m, given_m) * felt_share(orders / radius_m, half_m)
        finest = surface.orders(2 * math.pi * max(radius_m, circles[0].radius_m if count == 2 else 0.0))
        size = POINTS_OF_A_WAVE * max(int(finest.max(initial=0)), 1)
        found.append(heights(orders, felt, draw.uniform(0.0, 2 * math.pi, (count, orders.size)), size))
    return SurfaceHeights(np.array(found[:2]), found[2])


def contact_half_m(load_n_m: float, curvature_1_m: float) -> float:
    """Half length along the race of a line contact of steel under a load per length [m].

    b^2 = 4 P R / (pi E*), 1 / R the `curvature_1_m` of the gap (Johnson 1985, Contact Mechanics, sect. 4.2; quoted from
    memory, not checked).
    """
    modulus = YOUNG_N_M2 / (2 * (1 - POISSON**2))
    return math.sqrt(4 * load_n_m / (math.pi * curvature_1_m * modulus))


def felt_share(per_length_1_m: FloatArray, half_m: float) -> FloatArray:
    """Share J_0(k b) of a wave's amplitude that a contact of half length b feels, k radians per length.

    A small height h under a line contact brings its bodies nearer by the mean of h weighed by the pressure that one
    more newton adds, 1 / (pi sqrt(b^2 - x^2)) (Betti's reciprocity; the pressure is the derivative of Hertz's over the
    load); of a wave that is J_0. From the first zero on, waves shorter than 2.6 b, nothing is counted: of those the
    contact feels at most 0.4, in either sense.
    """
    from scipy.special import j0, jn_zeros

    reach = per_length_1_m * half_m
    return np.where(reach < jn_zeros(0, 1)[0], j0(reach), 0.0)


def heights(orders: FloatArray, amplitudes_m: FloatArray, phases_rad: FloatArray, size: int) -> FloatArray:
    """Sum of the waves at `size` even angles of each body, [bodies, size]; `phases_rad`, [bodies, orders]."""
    lines = np.zeros((len(phases_rad), size // 2 + 1), dtype=np.complex128)
    lines[:, orders.astype(int)] = amplitudes_m * np.exp(1j * phases_rad) * (size / 2)
    return np.fft.irfft(lines, n=size)
