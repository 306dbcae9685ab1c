"""The scene in MuJoCo, a general multibody engine with its own contacts: another engine's model of the same bearing.

MuJoCo gets the full model's bodies and points: the driven inner ring, the outer ring with its housing on spring and
damper, the cage on its gimbal, every roller on its slide and its own axis (82 free coordinates and one driven), and
each point of the races as a sphere of no size. A roller is three spheres, one for each circle, that touch the barrel
along that circle from within: the same depth, normal and lever. Load, masses, step and initial state are the same.

MuJoCo's contact law differs. A contact is a soft constraint whose spring and damper are set to K_c and C_c, but it
adds a virtual mass, `IMPEDANCE` / (1 - `IMPEDANCE`) of what the bodies weigh at the contact, and may not pull. Friction
is a cone with the dynamic coefficient alone, eq. (19) has a static one too; it creeps by the tangential force over
`FRICTION_STIFFER` C_c, 0.001 mm/s per N, where eq. (19) rises to its maximum at the critical velocity. The points'
normals stay in the plane of the roller's axis if the ring tilts. Source: MuJoCo documentation, *Computation*,
"Constraint model" and "Parameters", https://mujoco.readthedocs.io/en/stable/computation.

    pip install mujoco
    srbval bench --model mujoco_bearing.py:simulate --quick
"""

import math
import time
from collections.abc import Iterator
from typing import Any

import mujoco
import numpy as np

import srbval
from srbval.bearing import CIRCLES, Fault
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters, make_parameters, state_layout
from srbval.models.full.point_cloud import circle_points, race_circle

POINT_M = 1e-6  # radius of a point; a roller's spheres are smaller by it
IMPEDANCE = 0.1
FRICTION_STIFFER = 1000.0
BLOCKED_NMS = 1e6  # of the servo that drives the inner ring, per rad/s of difference


def simulate(scene: srbval.Scene) -> srbval.SimulatedSignals:
    """Run the scene from the static balance and the rolling speeds that the full model starts from too."""
    geometry = srbval.load_bearing(scene.bearing).geometry
    parameters = make_parameters(scene, geometry)
    model = mujoco.MjModel.from_xml_string(describe(scene, geometry, parameters))
    soften(model, parameters)
    data = mujoco.MjData(model)
    start(data, scene, parameters)
    mujoco.mj_forward(model, data)
    samples = round((scene.settle_s + scene.duration_s) * scene.output_rate_hz)
    speed, place, cage = np.empty((samples + 1, 3)), np.empty((samples, 3)), np.empty(samples)
    speed[0] = data.qvel[:3]
    started = time.perf_counter()
    for sample in range(samples):
        mujoco.mj_step(model, data, scene.steps_per_output)
        speed[sample + 1], place[sample] = data.qvel[:3], data.qpos[:3]
        cage[sample] = 2 * math.atan2(data.qpos[7], data.qpos[4])
    wall_s, rate = time.perf_counter() - started, scene.output_rate_hz
    return srbval.SimulatedSignals(
        np.arange(samples) / rate,
        np.diff(speed, axis=0) * rate,
        cage_angle_rad=cage,
        ring_displacement_m=place,
        wall_s=wall_s,
    )


def describe(scene: srbval.Scene, geometry: Any, model: Parameters) -> str:
    """The scene as MuJoCo's XML. Bodies: ``outer``, ``inner``, ``cage`` and in it the rollers, row 1 first."""
    rollers = "".join(roller(model, geometry, number, angle) for number, angle in enumerate(model.slot_angle))
    outer, inner = (
        "".join(
            f'<geom class="race" pos="{numbers(place)}" conaffinity="{circle}"/>'
            for circle, place in race_points(scene, geometry, race)
        )
        for race in (Fault.OUTER, Fault.INNER)
    )
    springs = "".join(
        f'<joint type="slide" axis="{axis}" stiffness="{model.housing_stiffness}" damping="{model.housing_damping}"/>'
        for axis in ("1 0 0", "0 1 0", "0 0 1")
    )
    inertia = f"{model.cage_transverse} {model.cage_transverse} {model.cage_axial}"
    return f"""<mujoco>
<compiler autolimits="false"/>
<option timestep="{scene.solver.step_s!r}" integrator="implicitfast" cone="elliptic" impratio="{FRICTION_STIFFER}"
        gravity="0 {model.gravity} 0"/>
<default>
  <geom type="sphere" size="{POINT_M}" contype="0" conaffinity="0" condim="3" mass="0"
        friction="{model.law.dynamic_friction} 0 0" solimp="{IMPEDANCE} {IMPEDANCE} 0.001 0.5 2"/>
  <default class="race"><geom priority="1"/></default>
</default>
<worldbody>
  <body name="outer">{springs}{inertial(model.ring_mass, "1 1 1")}{outer}</body>
  <body name="inner"><joint name="shaft" axis="0 0 1"/>{inertial(1.0, "1 1 1")}{inner}</body>
  <body name="cage"><joint type="ball"/>{inertial(scene.bodies.cage_mass_kg, inertia)}{rollers}</body>
</worldbody>
<actuator><velocity joint="shaft" kv="{BLOCKED_NMS}"/></actuator>
</mujoco>"""


def roller(model: Parameters, geometry: Any, number: int, angle: float) -> str:
    """A roller in its slot, with a sphere for each circle whose surface is the barrel's there, normal included."""
    side = 1 if number < len(model.slot_angle) // 2 else -1
    c, s = math.cos(angle), math.sin(angle)
    out = np.array([model.tilt_cosine * c, model.tilt_cosine * s, side * model.tilt_sine])
    along = np.array([-s, c, 0.0])
    inertia = f"{model.roller_transverse} {model.roller_transverse} {model.roller_axial}"
    off_axis = model.law.profile_radius - model.law.roller_radius  # how far the arc's centre is beyond the axis
    spheres = ""
    for circle, p in enumerate(CIRCLES):
        aside = (p - 1) * geometry.tilt_rad  # of the barrel's normal there
        radius = model.law.profile_radius - off_axis / math.cos(aside) - POINT_M
        spheres += f'<geom size="{radius}" pos="0 0 {side * off_axis * math.tan(aside)}" contype="{1 << circle}"/>'
    return (
        f'<body pos="{numbers(model.centre_distance * out)}" xyaxes="{numbers(out)} {numbers(along)}">'
        '<joint type="slide" axis="1 0 0"/><joint axis="0 0 1"/>'
        f"{inertial(model.roller_mass, inertia)}{spheres}</body>"
    )


def race_points(scene: srbval.Scene, geometry: Any, race: Fault) -> Iterator[tuple[int, np.ndarray]]:
    """Bit of the rollers' circle that meets it, and place of every point of a race [m], defects included."""
    outer, zone, count = race is Fault.OUTER, scene.load.zone_rad, scene.contact.points_per_circle
    for row, side in ((1, 1), (2, -1)):
        for number, p in enumerate(CIRCLES, start=1):
            circle = race_circle(geometry, p, inner=not outer)
            defects = [d for d in scene.defects if (d.kind, d.row, d.circle) == (race, row, number)]
            points = circle_points(count, circle.radius_m, defects, zone)
            radial = circle.radius_m + points.lift * circle.normal_radial
            axial = side * (circle.height_m + points.lift * circle.normal_axial)
            bit = 1 << (number - 1 if outer else len(CIRCLES) - number)
            for place in np.stack([radial * np.cos(points.angle), radial * np.sin(points.angle), axial], axis=1):
                yield bit, place


def soften(model: Any, parameters: Parameters) -> None:
    """Set springs and dampers of K_c and C_c: a contact's force is (-b v - k r - a) / R, with R by the bodies' weight.

    R = (1 - d) / d w at impedance d; MuJoCo divides the b and k that it is given by d.
    """
    weight = model.body_invweight0[:, 0]
    for race in ("outer", "inner"):
        body = model.body(race).id
        given = (weight[body] + weight[-1]) * (1 - IMPEDANCE)
        of_race = model.geom_bodyid == body
        model.geom_solref[of_race] = -parameters.law.stiffness * given, -parameters.law.damping * given


def start(data: Any, scene: srbval.Scene, parameters: Parameters) -> None:
    """Set the full model's static balance, its rolling speeds and the load."""
    state, layout = equilibrium_state(parameters), state_layout(parameters)
    shaft, (cage,) = scene.shaft_speed_rad_s, state[layout.shaft_cage_rate]
    data.qpos[:3] = state[layout.ring]
    data.qpos[8::2] = state[layout.slide]
    data.qvel[3], data.qvel[6] = shaft, cage
    data.qvel[8::2] = state[layout.spin] - cage * parameters.tilt_cosine
    data.ctrl[0] = shaft
    load = scene.load
    across, along = math.cos(load.direction_rad), math.sin(load.direction_rad)
    data.qfrc_applied[:3] = [load.radial_n * across, load.radial_n * along, load.axial_n]


def inertial(mass: float, inertia: str) -> str:
    """Mass and inertia of a body, about its own place."""
    return f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>'


def numbers(values: np.ndarray) -> str:
    """Numbers as XML has them, to the last digit."""
    return " ".join(repr(float(value)) for value in values)
