"""The full model once more, as differently as can be: NumPy, world axes, every point against every roller.

Raceways straight from eqs (16) and (17), forces from eqs (18) and (19), body masses by summing slices. No candidates,
no slot frames, no mass matrix: inertia is checked through momenta, whose rates of change are found by difference
quotients. Shared with the model: the scene, the geometry table, the layout of the state.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from srbval.bearing import Fault, SphericalRollerGeometry
from srbval.scene import Defect, LoadPath, RollerFit, Scene
from tests.verification.harness import geometry, layout_of

FloatArray = NDArray[np.float64]
P = (0.5, 1.0, 1.5)
GRAVITY = 9.80665
SLICES = 20_000
NEAR_M = 0.04  # no point further than this from a roller's centre can touch it: sqrt(20^2 + 15^2) mm = 25 mm


class Bodies(NamedTuple):
    """Masses [kg], moments of inertia [kg m2]; the cage is a thin ring at the pitch radius."""

    roller: float
    roller_axial: float
    roller_transverse: float
    ring: float
    cage_axial: float


class Contacts(NamedTuple):
    """What the contacts do: on rollers (about their centres), on the rings, losses, energy, normal forces."""

    force: FloatArray
    torque: FloatArray
    on_ring: FloatArray
    on_shaft: float
    rubbed: float
    damped: float
    stored: float
    load: FloatArray
    touching: int


class Touching(NamedTuple):
    """Points of one race inside rollers, n of them: which, where, how they move past the roller, what they do.

    `arm` from the roller's centre, `normal` off the roller, `slide` along its surface: [n, 3]. Normal force `press` and
    its elastic part `spring` [N], friction over slip `drag` and coefficient of the damper that acts `damper` [N s/m].
    """

    roller: NDArray[np.int64]
    circle: NDArray[np.int64]
    arm: FloatArray
    normal: FloatArray
    depth: FloatArray
    closing: FloatArray
    slide: FloatArray
    spring: FloatArray
    press: FloatArray
    drag: FloatArray
    damper: FloatArray


class World:
    """One scene in world axes; `turning`: -1 if a shaft of constant speed turns backwards."""

    def __init__(self, scene: Scene, turning: int = 1) -> None:
        self.scene, self.turning, self.g = scene, turning, geometry()
        self.radius = _roller_radius(scene, self.g)
        self.bodies = _bodies(scene, self.g, self.radius)
        self.clouds = [_cloud(scene, self.g, race) for race in ("outer", "inner")]
        row = np.arange(self.g.rollers_per_row) * 2 * np.pi / self.g.rollers_per_row
        self.slot_angle = np.append(row, row + scene.bodies.row_stagger * row[1])
        self.side = np.repeat([1.0, -1.0], self.g.rollers_per_row)

    def shaft(self, t: float) -> tuple[float, float]:
        """Speed [rad/s] and angle [rad] of the shaft at time `t` of the run, settling included."""
        profile = self.scene.speed_profile
        if profile is None:
            speed = self.turning * self.scene.shaft_speed_rad_s
            return speed, speed * t
        times = np.array(profile.time_s) + self.scene.settle_s
        inside = np.unique(np.concatenate([[0.0, t], times[(times > 0) & (times < t)]]))
        speed = np.interp(inside, times, profile.speed_rad_s)
        return float(speed[-1]), float(np.trapezoid(speed, inside))

    def external_load(self, t: float) -> FloatArray:
        """Force on the outer ring [N] at time `t`."""
        load, profile = self.scene.load, self.scene.load_profile
        radial, axial = load.radial_n, load.axial_n
        if profile is not None:
            times = np.array(profile.time_s) + self.scene.settle_s
            radial, axial = (float(np.interp(t, times, column)) for column in (profile.radial_n, profile.axial_n))
        return np.array([radial * np.cos(load.direction_rad), radial * np.sin(load.direction_rad), axial])

    def gravity(self) -> FloatArray:
        """Acceleration of gravity [m/s2]."""
        return np.array([0.0, -GRAVITY if self.scene.load.gravity else 0.0, 0.0])

    def housing_stiffness(self) -> float:
        """Stiffness of the spring that the outer ring hangs on [N/m]."""
        return self.scene.housing.stiffness_n_m if self.scene.load.path is LoadPath.HOUSING else 0.0

    def slots(self, y: FloatArray) -> FloatArray:
        """Slot axes as columns of rotation matrices, [N, 3, 3]: x along the slot, z along the roller."""
        cage = Rotation.from_euler("XYZ", y[layout_of(y).cage])
        ahead = np.where(self.side < 0, y[layout_of(y).relative_angle].sum(), 0.0)
        turns = Rotation.from_euler("ZY", np.stack([self.slot_angle + ahead, -self.side * self.g.tilt_rad], axis=1))
        return (cage * turns).as_matrix()

    def cage_omega(self, y: FloatArray) -> FloatArray:
        """Angular velocity of the cage that each roller is in [N, 3]: row 2's own turns about the same axis."""
        ahead = np.where(self.side < 0, y[layout_of(y).relative_rate].sum(), 0.0)
        return y[layout_of(y).cage_rate] + ahead[:, None] * self.cage_axis(y)

    def cage_axis(self, y: FloatArray) -> FloatArray:
        """Axis of the cage."""
        return Rotation.from_euler("XYZ", y[layout_of(y).cage]).as_matrix()[:, 2]

    def centres(self, y: FloatArray) -> FloatArray:
        """Roller centres [N, 3]."""
        reach = self.g.pitch_radius_m / np.cos(self.g.tilt_rad) + y[layout_of(y).slide]
        return self.slots(y)[:, :, 0] * reach[:, None]

    def centre_rates(self, y: FloatArray) -> FloatArray:
        """Velocities of the roller centres [N, 3]."""
        where, slots = layout_of(y), self.slots(y)
        return np.cross(self.cage_omega(y), self.centres(y)) + y[where.slide_rate][:, None] * slots[:, :, 0]

    def roller_omega(self, y: FloatArray) -> FloatArray:
        """Angular velocities of the rollers [N, 3]: the cage's across their axes, their spin along."""
        axis, cage = self.slots(y)[:, :, 2], self.cage_omega(y)
        return cage + (y[layout_of(y).spin] - (axis * cage).sum(axis=1))[:, None] * axis

    def momentum(self, y: FloatArray) -> FloatArray:
        """Angular momentum of cage and rollers about the bearing centre [kg m2/s], [3]."""
        own = np.cross(self.centres(y), self.bodies.roller * self.centre_rates(y)) + self.own_momenta(y)
        return own.sum(axis=0) + self.cage_momenta(y).sum(axis=0)

    def mechanical_energy(self, y: FloatArray) -> float:
        """Kinetic energy of all bodies, energy in gravity and in the housing's spring [J]."""
        where, b = layout_of(y), self.bodies
        kinetic = b.roller * (self.centre_rates(y) ** 2).sum() + (self.roller_omega(y) * self.own_momenta(y)).sum()
        ahead = y[where.relative_rate].sum() * self.cage_axis(y)  # of row 2's cage
        kinetic += ([y[where.cage_rate], y[where.cage_rate] + ahead] * self.cage_momenta(y)).sum()
        kinetic += b.ring * (y[where.ring_rate] ** 2).sum()
        weight = b.roller * self.centres(y).sum(axis=0) + b.ring * y[where.ring]
        spring = self.housing_stiffness() * (y[where.ring] ** 2).sum()
        return float((kinetic + spring) / 2 - weight @ self.gravity())

    def own_momenta(self, y: FloatArray) -> FloatArray:
        """Angular momenta of the rollers about their centres [kg m2/s], [N, 3]."""
        axis, omega, b = self.slots(y)[:, :, 2], self.roller_omega(y), self.bodies
        along = (omega * axis).sum(axis=1)[:, None] * axis
        return b.roller_transverse * (omega - along) + b.roller_axial * along

    def cage_momenta(self, y: FloatArray) -> FloatArray:
        """Angular momenta of the two rows' cages, of half of the mass each [kg m2/s], [2, 3]."""
        omega, axis, half = y[layout_of(y).cage_rate], self.cage_axis(y), self.bodies.cage_axial / 2
        along = (omega @ axis + np.array([0.0, y[layout_of(y).relative_rate].sum()]))[:, None] * axis
        return half / 2 * (omega - (omega @ axis) * axis) + half * along

    def contacts(self, t: float, y: FloatArray) -> Contacts:
        """Every point of both clouds against every roller."""
        centres = self.centres(y)
        on_rollers, load = np.zeros((2, 2, len(centres), 3)), np.zeros((2, len(centres), 3, 3))  # [race, ...]
        both = [self.touching(t, y, race) for race in (0, 1)]
        for race, p in enumerate(both):
            push = -p.press[:, None] * p.normal
            f = push + p.drag[:, None] * p.slide
            for sums, part in zip(on_rollers[race], (f, np.cross(p.arm, f)), strict=True):
                np.add.at(sums, p.roller, part)
            np.add.at(load[race], (p.roller, p.circle), push)
        (outer, _), (inner, turning) = on_rollers
        force, torque = on_rollers.sum(axis=0)
        return Contacts(
            force=force,
            torque=torque,
            on_ring=-outer.sum(axis=0),
            on_shaft=-float((np.cross(centres, inner) + turning)[:, 2].sum()),
            rubbed=sum(float((p.drag * (p.slide**2).sum(axis=1)).sum()) for p in both),
            damped=sum(float(((p.press - p.spring) * p.closing).sum()) for p in both),
            stored=sum(float((p.spring * p.depth).sum() / 2) for p in both),
            load=np.linalg.norm(load, axis=3),
            touching=sum(len(p.roller) for p in both),
        )

    def touching(self, t: float, y: FloatArray, race: int) -> Touching:
        """Every point of a race, outer 0 and inner 1, that is inside a roller."""
        where, c = layout_of(y), self.scene.contact
        centres, axes = self.centres(y), self.slots(y)[:, :, 2]
        cloud = self.clouds[race]
        if race == 0:
            at, out = cloud.position + y[where.ring], cloud.normal
            rate = np.tile(y[where.ring_rate], (len(cloud.share), 1))
        else:
            speed, angle = self.shaft(t)
            turned = Rotation.from_euler("z", angle)
            at, out = turned.apply(cloud.position), turned.apply(cloud.normal)
            rate = np.cross([0.0, 0.0, speed], at)
        distance = ((at[None, :, :] - centres[:, None, :]) ** 2).sum(axis=2)
        j, i = np.nonzero(distance < NEAR_M**2)
        foot = at[i] - centres[j]
        arm = foot + self._met_height(y, j, foot)[:, None] * out[i]
        along = (arm * axes[j]).sum(axis=1)
        across = arm - along[:, None] * axes[j]
        rho = np.linalg.norm(across, axis=1)
        to_arc = (rho + self.g.raceway_radius_m - self.radius)[:, None] * across / rho[:, None]
        to_arc += along[:, None] * axes[j]
        depth = self.g.raceway_radius_m - np.linalg.norm(to_arc, axis=1)
        hit = depth > 0
        j, i, arm, depth = j[hit], i[hit], arm[hit], depth[hit]
        normal = to_arc[hit] / np.linalg.norm(to_arc[hit], axis=1)[:, None]
        relative = rate[i] - self.centre_rates(y)[j] - np.cross(self.roller_omega(y)[j], arm)
        closing = -(relative * normal).sum(axis=1)
        x = np.clip(depth / c.smoothing_width_m, 0, 1)
        smooth = cloud.share[i] * (3 * x**2 - 2 * x**3)
        spring = smooth * c.stiffness_n_m * depth
        damper = smooth * c.damping_ns_m
        press = np.maximum(spring + damper * closing, 0.0)
        slide = relative + closing[:, None] * normal
        slip = np.linalg.norm(slide, axis=1)
        return Touching(
            roller=j,
            circle=cloud.circle[i],
            arm=arm,
            normal=normal,
            depth=depth,
            closing=closing,
            slide=slide,
            spring=spring,
            press=press,
            drag=press * friction_per_slip(self.scene, slip),
            damper=np.where(press > 0, damper, 0.0),
        )

    def _met_height(self, y: FloatArray, j: NDArray[np.int64], arm: FloatArray) -> FloatArray:
        """Height of the rollers' own defects where points of the races stand, `arm` from the centres of rollers `j`."""
        height, slots, reach = np.zeros(len(j)), self.slots(y)[j], self.g.raceway_radius_m
        x, across, along = (np.einsum("ij,ij->i", arm, slots[:, :, k]) for k in range(3))
        for d in self.scene.defects:
            if d.kind is not Fault.ROLLER:
                continue
            own = (d.row - 1) * self.g.rollers_per_row + d.roller - 1
            place, gap = (reach * np.sin(p * self.g.tilt_rad) for p in (P[d.circle - 1] - 1, P[2] - 1))
            there = (j == own) & (np.abs(along - place * (1 if d.row == 1 else -1)) <= gap / 2)
            arc = self.radius * _from(d.angle_rad, np.arctan2(across, x) - y[layout_of(y).rotation][j])
            height += np.where(there, _height(d, arc), 0.0)
        return height


def friction_per_slip(scene: Scene, slip: FloatArray) -> FloatArray:
    """Coefficient of friction over slip [s/m]; it goes from 0 to mu_s at v_c, to mu_d at 1.5 v_c and stays (eq. 19)."""
    c = scene.contact
    knots = [0.0, c.critical_velocity_m_s, 1.5 * c.critical_velocity_m_s]
    coefficient = np.interp(slip, knots, [0.0, c.static_friction, c.dynamic_friction])
    return np.where(slip > 0, coefficient / np.maximum(slip, 1e-300), c.static_friction / c.critical_velocity_m_s)


def circle_profile(g: SphericalRollerGeometry, race: str, p: float) -> tuple[float, float, float, float]:
    """Radius and height of circle p of row 1 [m] and its normal towards the rollers (eq. 17, its sign mended)."""
    c, s = np.cos(p * g.tilt_rad), np.sin(p * g.tilt_rad)
    if race == "outer":
        return g.raceway_radius_m * c, g.raceway_radius_m * s, -c, -s
    return g.inner_centre_radial_m - g.raceway_radius_m * c, g.inner_centre_axial_m - g.raceway_radius_m * s, c, s


class Cloud(NamedTuple):
    """Points of one raceway in its ring's frame: position and normal [n, 3], share of K_c and C_c, circle 0 to 2."""

    position: FloatArray
    normal: FloatArray
    share: FloatArray
    circle: NDArray[np.int64]


def _cloud(scene: Scene, g: SphericalRollerGeometry, race: str) -> Cloud:
    clouds = []
    for row, side in ((1, 1.0), (2, -1.0)):
        for circle, p in enumerate(P, start=1):
            radius, height, out, up = circle_profile(g, race, p)
            angle, share, lift = _circle(scene, race, row, circle, radius)
            r, z = radius + lift * out, side * (height + lift * up)
            position = np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=1)
            normal = np.stack([out * np.cos(angle), out * np.sin(angle), np.full(len(angle), side * up)], axis=1)
            clouds.append(Cloud(position, normal, share, np.full(len(angle), circle - 1)))
    return Cloud(*map(np.concatenate, zip(*clouds, strict=True)))


def _circle(scene: Scene, race: str, row: int, circle: int, radius: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Angle, share and lift of the points of one circle."""
    n = scene.contact.points_per_circle
    angle, share, lift = np.arange(n) * 2 * np.pi / n, np.ones(n), np.zeros(n)
    for d in scene.defects:
        if d.kind.value != race or (d.row, d.circle) != (row, circle):
            continue
        middle = scene.load.zone_rad + d.angle_rad
        if d.extent_m is None:
            first = round(middle / (2 * np.pi) * n - (d.points - 1) / 2)
            lift[[(first + i) % n for i in range(d.points)]] += d.height_m
            continue
        near = np.abs(_from(middle, angle)) <= d.extent_m / (2 * radius) + 2 * np.pi / n
        fine = [
            a + (2 * np.pi / n) * ((i + 0.5) / d.refinement - 0.5) for a in angle[near] for i in range(d.refinement)
        ]
        angle = np.concatenate([angle[~near], fine])
        share = np.concatenate([share[~near], np.repeat(share[near], d.refinement) / d.refinement])
        lift = np.concatenate([lift[~near], np.repeat(lift[near], d.refinement)])
        lift = lift + _height(d, _from(middle, angle) * radius)
    return angle, share, lift


def _from(middle: float, angle: FloatArray) -> FloatArray:
    """Angle from `middle`, between -pi and pi."""
    return np.angle(np.exp(1j * (angle - middle)))


def _height(d: Defect, place: FloatArray) -> FloatArray:
    """Height of an extended defect at a distance along the race from its middle [m]."""
    return np.where(np.abs(place) <= d.extent_m / 2, d.height_m, 0.0)


def _roller_radius(scene: Scene, g: SphericalRollerGeometry) -> float:
    """Half of Table 1's diameter, or of the gap between the raceways along the contact normal less the play."""
    if scene.contact.roller_fit is RollerFit.PRINTED:
        return g.roller_diameter_m / 2
    centre = g.pitch_radius_m * np.array([1.0, np.tan(g.tilt_rad)])
    to_inner = np.linalg.norm(np.array([g.inner_centre_radial_m, g.inner_centre_axial_m]) - centre)
    gap = 2 * g.raceway_radius_m - np.linalg.norm(centre) - to_inner
    return float(gap - scene.contact.radial_play_m) / 2


def _bodies(scene: Scene, g: SphericalRollerGeometry, radius: float) -> Bodies:
    density = scene.bodies.density_kg_m3
    middle = (np.arange(SLICES) + 0.5) / SLICES - 0.5
    z, dz = middle * g.roller_width_m, g.roller_width_m / SLICES
    r = radius - g.raceway_radius_m + np.sqrt(g.raceway_radius_m**2 - z**2)
    disc = density * np.pi * r**2 * dz
    bore, height = g.raceway_radius_m**2 - (middle * g.width_m) ** 2, g.width_m / SLICES
    ring = density * np.pi * float(((g.outer_diameter_m / 2) ** 2 - bore).sum()) * height
    return Bodies(
        roller=float(disc.sum()),
        roller_axial=float((disc * r**2 / 2).sum()),
        roller_transverse=float((disc * (r**2 / 4 + z**2)).sum()),
        ring=ring + scene.housing.mass_kg,
        cage_axial=scene.bodies.cage_mass_kg * g.pitch_radius_m**2,
    )
