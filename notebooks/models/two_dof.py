"""A ring of two degrees of freedom on nonlinear springs, with a defect as a half sine: a model to copy and change.

Source: Patil, Mathew, Rajendrakumar & Desai (2010), A theoretical model to predict the effect of localized defect on
vibrations associated with ball bearing, Int. J. Mech. Sci. 52, 1193-1201. The rolling elements turn with the kinematic
cage; each is a spring between the races that cannot pull, and a defect changes its length by half a sine while it
passes. In place of their ball contact: Palmgren's line contact of steel rollers (Harris & Kotzalas 2006, ch. 6), two in
series. The ring moves and the shaft stands, a bump is as high as a roller of that diameter meets on its length.

    srbval simulate rig --model two_dof.py:simulate --defect outer --seconds 1
    srbval bench --model two_dof.py:simulate --quick
"""

import math

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

import srbval

SOLVERS = ("RK45", "DOP853", "RK23")  # of solve_ivp; the first unless --solver names one
LINE_CONTACT, EXPONENT = 3.84e-5, 10 / 9  # Palmgren: mm = 3.84e-5 N^0.9 / mm^0.8
DEFECT_M = 2e-3  # length, where the scene states none


def simulate(scene: srbval.Scene) -> srbval.SimulatedSignals:
    """Acceleration and displacement of the ring in the scene; speed and load are constant."""
    bearing = srbval.load_bearing(scene.bearing)
    shape, count, load, defect = bearing.geometry, bearing.rolling_elements, scene.load, scene.defect
    cage_rad_s = bearing.orders.ftf * scene.shaft_speed_rad_s
    length = defect.extent_m or DEFECT_M
    radius = shape.pitch_radius_m + shape.roller_diameter_m / 2 * (1 if defect.kind == "outer" else -1)
    height = math.copysign(min(abs(defect.height_m), length**2 / (4 * shape.roller_diameter_m)), defect.height_m)
    stiffness = (1e3 / (2 * LINE_CONTACT)) ** EXPONENT * (1e3 * shape.roller_width_m) ** (0.8 * EXPONENT)  # N/m^(10/9)
    spring = scene.housing.stiffness_n_m if load.path == "housing" else 0.0
    push = load.radial_n * np.array([math.cos(load.direction_rad), math.sin(load.direction_rad)])

    def force(time_s: float, ring: np.ndarray) -> np.ndarray:
        """Force on the ring at rest at a displacement, both rows alike."""
        angle = cage_rad_s * time_s + 2 * np.pi / count * np.arange(count)
        depth = -(ring[0] * np.cos(angle) + ring[1] * np.sin(angle))
        if defect.kind != "healthy":
            turned = scene.shaft_speed_rad_s * time_s if defect.kind == "inner" else 0.0
            away = (angle - load.zone_rad - defect.angle_rad - turned + np.pi) % (2 * np.pi) - np.pi
            depth += height * np.cos(np.pi * np.clip(away * radius / length, -0.5, 0.5))
        load_n = 2 * stiffness * np.maximum(depth, 0.0) ** EXPONENT
        return push + np.array([load_n @ np.cos(angle), load_n @ np.sin(angle)]) - spring * ring

    def rate(time_s: float, state: np.ndarray) -> np.ndarray:
        pull = force(time_s, state[:2]) - scene.housing.damping_ns_m * state[2:]
        return np.concatenate([state[2:], pull / scene.housing.mass_kg])

    samples = round((scene.settle_s + scene.duration_s) * scene.output_rate_hz)
    time_s = np.arange(samples) / scene.output_rate_hz
    sag = root(lambda ring: force(0.0, 1e-6 * ring) / 1e3, 10 * push / np.abs(push).max()).x * 1e-6
    span, begin = (0.0, time_s[-1]), [*sag, 0.0, 0.0]
    how = {"method": scene.solver.name, "max_step": scene.solver.step_s, "rtol": 1e-4, "atol": 1e-10}
    state = solve_ivp(rate, span, begin, t_eval=time_s, **how).y.T
    acceleration = np.array([rate(*one)[2:] for one in zip(time_s, state, strict=True)])
    return srbval.SimulatedSignals(
        time_s, acceleration, cage_ratio=bearing.orders.ftf, ring_displacement_m=state[:, :2]
    )
