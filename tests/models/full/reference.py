"""The contact forces of the full model once more, written as differently as can be.

World axes, NumPy, every point of both clouds against every roller, rotation matrices from scipy, eq. (17) to (19)
straight from the paper: no candidates, no slot frames, no angle addition, nothing shared with the kernels but the
state's layout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from srbval.bearing import Fault, SphericalRollerGeometry
from srbval.models.full.parameters import roller_diameter_m
from srbval.scene import Scene

P = (0.5, 1.0, 1.5)


@dataclass
class State:
    slide: np.ndarray
    cage: np.ndarray
    ring: np.ndarray
    slide_rate: np.ndarray
    spin: np.ndarray
    omega: np.ndarray
    ring_rate: np.ndarray

    @classmethod
    def of(cls, y: np.ndarray) -> State:
        n = (len(y) // 2 - 6) // 2
        d = len(y) // 2
        return cls(
            slide=y[:n], cage=y[2 * n : 2 * n + 3], ring=y[2 * n + 3 : d],
            slide_rate=y[d : d + n], spin=y[d + n : d + 2 * n],
            omega=y[d + 2 * n : d + 2 * n + 3], ring_rate=y[d + 2 * n + 3 :],
        )  # fmt: skip


def clouds(scene: Scene, g: SphericalRollerGeometry) -> dict[str, np.ndarray]:
    """Both clouds in their own rings' frames, [points, 3], defect included."""
    n = scene.contact.points_per_circle
    angle = np.arange(n) * 2 * np.pi / n
    found = {}
    for kind in ("outer", "inner"):
        points = []
        for row, side in ((1, 1.0), (2, -1.0)):
            for circle, p in enumerate(P, start=1):
                c, s = np.cos(p * g.tilt_rad), np.sin(p * g.tilt_rad)
                if kind == "outer":
                    radius, height, normal = g.raceway_radius_m * c, g.raceway_radius_m * s, (-c, -s)
                else:
                    radius = g.inner_centre_radial_m - g.raceway_radius_m * c
                    height = g.inner_centre_axial_m - g.raceway_radius_m * s
                    normal = (c, s)
                lift = np.zeros(n)
                d = scene.defect
                if d.kind is Fault(kind) and (d.row, d.circle) == (row, circle):
                    middle = scene.load.zone_rad + d.angle_rad
                    first = round(middle / (2 * np.pi) * n - (d.points - 1) / 2)
                    lift[[(first + i) % n for i in range(d.points)]] = d.height_m
                r = radius + lift * normal[0]
                points.append(
                    np.stack([r * np.cos(angle), r * np.sin(angle), side * (height + lift * normal[1])], axis=1)
                )
        found[kind] = np.concatenate(points)
    return found


def friction(scene: Scene, slip: np.ndarray) -> np.ndarray:
    """Coefficient of friction: 0 to mu_s up to v_c, down to mu_d at 1.5 v_c, then constant."""
    c = scene.contact
    knots = [0.0, c.critical_velocity_m_s, 1.5 * c.critical_velocity_m_s]
    return np.interp(slip, knots, [0.0, c.static_friction, c.dynamic_friction])


def roller_frames(g: SphericalRollerGeometry, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Centres [N, 3] and slot axes as rotation matrices [N, 3, 3] (columns x, y, z) in world axes."""
    count = 2 * g.rollers_per_row
    angle = np.tile(np.arange(g.rollers_per_row) * 2 * np.pi / g.rollers_per_row, 2)
    side = np.repeat([1.0, -1.0], g.rollers_per_row)
    cage = Rotation.from_euler("XYZ", state.cage)
    axes = np.array([
        (cage * Rotation.from_euler("z", angle[j]) * Rotation.from_euler("y", -side[j] * g.tilt_rad)).as_matrix()
        for j in range(count)
    ])  # fmt: skip
    reach = g.roller_centre_distance_m + state.slide
    return axes[:, :, 0] * reach[:, None], axes


def contact_forces(scene: Scene, g: SphericalRollerGeometry, t: float, y: np.ndarray) -> dict[str, np.ndarray]:
    """Force [N, 3] and torque about its centre [N, 3] on each roller, and the total force on the outer ring."""
    state = State.of(y)
    centres, axes = roller_frames(g, state)
    c = scene.contact
    radius, profile = roller_diameter_m(scene, g) / 2, g.raceway_radius_m
    force, torque, on_ring = np.zeros_like(centres), np.zeros_like(centres), np.zeros(3)
    shaft = np.array([0.0, 0.0, scene.shaft_speed_rad_s])
    own = clouds(scene, g)
    turned = Rotation.from_euler("z", scene.shaft_speed_rad_s * t).apply(own["inner"])
    world = {"outer": (own["outer"] + state.ring, np.broadcast_to(state.ring_rate, own["outer"].shape)),
             "inner": (turned, np.cross(shaft, turned))}  # fmt: skip
    for j, (centre, axis) in enumerate(zip(centres, axes, strict=True)):
        z = axis[:, 2]
        omega = state.omega - (state.omega @ z) * z + state.spin[j] * z
        centre_rate = np.cross(state.omega, centre) + state.slide_rate[j] * axis[:, 0]
        for kind, (points, rates) in world.items():
            arm = points - centre
            along = arm @ z
            across = arm - along[:, None] * z
            rho = np.linalg.norm(across, axis=1)
            to_arc = (rho + profile - radius)[:, None] * across / rho[:, None] + along[:, None] * z
            distance = np.linalg.norm(to_arc, axis=1)
            normal = to_arc / distance[:, None]
            depth = profile - distance
            touching = (depth > 0) & (np.abs(along) <= g.roller_width_m / 2) & (rho < 2 * radius)
            if not touching.any():
                continue
            relative = rates[touching] - centre_rate - np.cross(omega, arm[touching])
            n, deep = normal[touching], depth[touching]
            closing = -(relative * n).sum(axis=1)
            smooth = np.clip(deep / c.smoothing_width_m, 0, 1)
            load = (3 * smooth**2 - 2 * smooth**3) * np.maximum(c.stiffness_n_m * deep + c.damping_ns_m * closing, 0)
            slide = relative + closing[:, None] * n
            slip = np.linalg.norm(slide, axis=1)
            f = -load[:, None] * n + (friction(scene, slip) * load / slip)[:, None] * slide
            force[j] += f.sum(axis=0)
            torque[j] += np.cross(arm[touching], f).sum(axis=0)
            if kind == "outer":
                on_ring -= f.sum(axis=0)
    return {"force": force, "torque": torque, "on_ring": on_ring}
