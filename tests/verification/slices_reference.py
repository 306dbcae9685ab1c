"""Rollers between races of their own profile radii once more: continuous integrals along the roller, NumPy and SciPy.

Nothing of the model's kernels: circles in a roller's meridian, their gap, q = c_L / L (approach of both)^(10/9) after
ISO/TS 16281 with half of the approach for each contact, friction by a law of the slip. A roller's meridian has the axes
s along its slot, outwards, and x along its axis, away from the mid-plane; its centre is the origin. The outer ring
moves, rollers slide along their slots, the inner ring stays: all that held rollers do; free ones: `test_free_rollers`.
"""

from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from scipy.optimize import brentq, root

from tests.verification.harness import FloatArray, Parameters, Scene, geometry

STATIC: dict[str, Any] = {  # at rest, the load through the rollers alone; kernels as those of the scene `rig`
    "model": "slices",
    "bodies": {"cages": 2},
    "contact": {"static_friction": 0.0, "dynamic_friction": 0.0},
    "shaft_speed": "1e-6 rpm",
    "load": {"path": "bearing"},
}
C_L_N_MM = 35948.0  # times L^(8/9), L in mm: N/mm^(10/9)
PLACES = 120  # midpoints along a roller; three times as many move no load by 1e-4
FARTHEST_SLIDE_M = 3e-4
BISECTIONS = 38  # of 0.6 mm: to 2e-15 m, which is 5e-6 N on a loaded roller
LEAST_SLIP = 1e-9  # m/s, so that no range of slips is empty
RATIOS = (0.42, 0.445)  # of cage and shaft speed, pure rolling at a roller's ends
LEAST_RING_N = 1e-2  # where the ring counts as balanced
DIFFERENCE = 1e-6  # square of the share of a displacement by which it is varied: rounding leaves 1e-5 N


@dataclass(frozen=True)
class Friction:
    """Coefficient of friction: rises to `limit` at `critical_m_s` of slip and stays."""

    limit: float
    critical_m_s: float

    def mean(self, low: FloatArray, high: FloatArray) -> FloatArray:
        """Mean over slips from `low` to `high` [m/s], with their sign: difference of the law's integral."""
        return self.limit * (self._integral(high) - self._integral(low)) / (high - low)

    def _integral(self, slip: FloatArray) -> FloatArray:
        size, critical = np.abs(slip), self.critical_m_s
        return np.where(size < critical, size**2 / (2 * critical), size - critical / 2)


@dataclass(frozen=True, kw_only=True)
class Contacts:
    """Both contacts of all rollers: loads per length and where they act, [2 races, rollers, places].

    `force_n`: each place's share; `s_m`, `x_m`: the place in the roller's meridian; `normal_s`, `normal_x`: the normal
    there, off the roller.
    """

    force_n: FloatArray
    s_m: FloatArray
    x_m: FloatArray
    normal_s: FloatArray
    normal_x: FloatArray


@dataclass(frozen=True, kw_only=True)
class SlicedBearing:
    """Rollers at the angles `angle_rad`, rows `side` +1 and -1; `swing_n`: centrifugal force of each along its slot."""

    roller_m: float
    outer_osculation: float
    inner_osculation: float
    angle_rad: FloatArray
    side: FloatArray
    swing_n: float = 0.0

    @classmethod
    def like(cls, model: Parameters, scene: Scene) -> Self:
        """That of a scene, with the model's roller diameter and slots."""
        line, g, rollers = scene.line_contact, geometry(), len(model.slot_angle)
        return cls(
            roller_m=model.law.roller_radius,
            outer_osculation=line.outer_osculation or g.outer_osculation,
            inner_osculation=line.inner_osculation or g.inner_osculation,
            angle_rad=model.slot_angle,
            side=np.repeat([1.0, -1.0], rollers // 2),
        )

    def slot_and_axis(self, ring: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Components of a vector along every roller's slot and axis, [rollers]."""
        tilt = geometry().tilt_rad
        radial = ring[0] * np.cos(self.angle_rad) + ring[1] * np.sin(self.angle_rad)
        along = self.side * ring[2]
        return radial * np.cos(tilt) + along * np.sin(tilt), along * np.cos(tilt) - radial * np.sin(tilt)

    def arcs(self, ring: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Radii of the races' arcs, [2, 1]; their centres along slot and axis, off the slot's middle, [2, rollers]."""
        g = geometry()
        tilt = g.tilt_rad
        outer = g.raceway_radius_m
        inner = self.outer_osculation * outer / self.inner_osculation
        distance = g.pitch_radius_m / np.cos(tilt)
        ring_s, ring_x = self.slot_and_axis(ring)
        inner_s = g.inner_centre_radial_m * np.cos(tilt) + g.inner_centre_axial_m * np.sin(tilt)
        inner_x = g.inner_centre_axial_m * np.cos(tilt) - g.inner_centre_radial_m * np.sin(tilt)
        centre_s = np.array([ring_s - distance, np.full_like(ring_s, inner_s + inner - outer - distance)])
        return np.array([[outer], [inner]]), centre_s, np.array([ring_x, np.full_like(ring_x, inner_x)])

    def contacts(self, slide: FloatArray, ring: FloatArray) -> Contacts:
        """Both contacts of all rollers for these displacements [m]."""
        length = geometry().roller_width_m
        arc, centre_s, centre_x = self.arcs(ring)
        profile = self.outer_osculation * geometry().raceway_radius_m
        out = np.array([1.0, -1.0])[:, None, None]  # a race's arc lies outwards of its centre, or inwards
        lean = ((np.arange(PLACES) + 0.5) / PLACES * length - length / 2) / arc[:, :, None]
        s_m = (centre_s - slide)[:, :, None] + out * arc[:, :, None] * np.cos(lean)
        x_m = centre_x[:, :, None] + arc[:, :, None] * np.sin(lean)
        barrel_s = -out * (profile - self.roller_m)  # centre of the barrel's arc on that side
        off = np.hypot(s_m - barrel_s, x_m)
        depth = np.maximum(profile - off, 0.0)
        powers = np.power(2e3 * depth, 10 / 9, out=np.zeros_like(depth), where=depth > 0)
        per_m = C_L_N_MM * (1e3 * length) ** (8 / 9) / length * powers
        normal = {"normal_s": (s_m - barrel_s) / off, "normal_x": x_m / off}
        return Contacts(force_n=per_m * length / PLACES, s_m=s_m, x_m=x_m, **normal)

    def slides(self, ring: FloatArray) -> FloatArray:
        """Where every roller rests between the races [m]; one that nothing presses, where it is about to touch."""
        low = np.full(len(self.angle_rad), -FARTHEST_SLIDE_M)
        high = -low
        for _ in range(BISECTIONS):
            trial = (low + high) / 2
            found = self.contacts(trial, ring)
            outwards = self.swing_n - (found.force_n * found.normal_s).sum(axis=(0, 2)) > 0
            low, high = np.where(outwards, trial, low), np.where(outwards, high, trial)
        return (low + high) / 2

    def on_ring(self, found: Contacts) -> FloatArray:
        """Force of every roller on the outer ring, [rollers, 3]."""
        tilt = geometry().tilt_rad
        f_s, f_x = ((found.force_n[0] * n[0]).sum(axis=1) for n in (found.normal_s, found.normal_x))
        radial = f_s * np.cos(tilt) - f_x * np.sin(tilt)
        along = self.side * (f_s * np.sin(tilt) + f_x * np.cos(tilt))
        return np.stack([radial * np.cos(self.angle_rad), radial * np.sin(self.angle_rad), along], axis=1)

    def balance(self, load: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Ring's displacement [3] and slides [rollers] in balance with a force on the ring [N]."""

        def left(ring_um: FloatArray) -> FloatArray:
            ring = 1e-6 * ring_um
            return load + self.on_ring(self.contacts(self.slides(ring), ring)).sum(axis=0)

        for reach in (50.0, 100.0, 200.0, 400.0):
            start = np.round(reach * (load / np.linalg.norm(load) + [0.0, 0.0, np.sign(load[2])]), 6)
            solved = root(left, start, tol=1e-10, options={"eps": DIFFERENCE})
            if np.abs(solved.fun).max() < LEAST_RING_N:
                break
        assert np.abs(solved.fun).max() < LEAST_RING_N, solved.message
        ring: FloatArray = 1e-6 * solved.x
        return ring, self.slides(ring)


def balanced_ratio(cases: list[tuple[Contacts, FloatArray]], shaft_rad_s: float, friction: Friction) -> float:
    """Cage over shaft speed at which friction has no moment about the shaft, summed over `cases`: contacts and slides.

    Slips are averaged over the way between neighbouring places.
    """

    def moment(ratio: float) -> float:
        return sum(moment_about_shaft(*case, ratio, shaft_rad_s, friction) for case in cases)

    return float(brentq(moment, *RATIOS, xtol=1e-9))


def moment_about_shaft(
    found: Contacts, slide: FloatArray, ratio: float, shaft_rad_s: float, friction: Friction
) -> float:
    """Moment of friction on rollers about the shaft [N m], each turning so that friction has none about its axis.

    A roller's material at s and x moves at Omega (r - sin(tilt) x) + spin s, r its centre's radius about the shaft, the
    inner race at W times its radius about the shaft.
    """
    g = geometry()
    cage = ratio * shaft_rad_s
    tilt = g.tilt_rad
    centre = g.pitch_radius_m + slide * np.cos(tilt)
    about_shaft = centre[:, None] + found.s_m * np.cos(tilt) - found.x_m * np.sin(tilt)
    race = np.array([0.0, shaft_rad_s])[:, None, None] * about_shaft
    carried = cage * (centre[:, None] - np.sin(tilt) * found.x_m)

    def drags(spin: FloatArray) -> FloatArray:
        slip = race - carried - spin[:, None] * found.s_m
        half = np.abs(np.gradient(slip, axis=2)) / 2 + LEAST_SLIP
        return found.force_n * friction.mean(slip - half, slip + half)

    rolling = -cage * g.pitch_radius_m / found.s_m[0].mean(axis=1)
    low, high = 1.15 * rolling, 0.85 * rolling
    for _ in range(BISECTIONS):
        spin = (low + high) / 2
        faster = (drags(spin) * found.s_m).sum(axis=(0, 2)) > 0
        low, high = np.where(faster, spin, low), np.where(faster, high, spin)
    return float((drags((low + high) / 2) * about_shaft).sum())
