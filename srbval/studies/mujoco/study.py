"""The same scene in MuJoCo, a general multibody engine: what a simulated second costs there, and here.

MuJoCo gets the full model's bodies and points: the driven inner ring, the outer ring with its housing on spring and
damper, the cage on its gimbal, every roller on its slide and its own axis (82 free coordinates and one driven), and
each point of the races as a sphere of no size. A roller is three spheres, one for each circle, that touch the barrel
along that circle from within: the same depth, normal and lever. Load, masses, step and initial state are the same.

What differs is MuJoCo's contact law. A contact is a soft constraint whose spring and damper are set to K_c and C_c, but
it adds a virtual mass, `IMPEDANCE` / (1 - `IMPEDANCE`) of what the bodies weigh at the contact, and may not pull.
Friction is a cone with the dynamic coefficient alone, eq. (19) has a static one too; it creeps by the tangential
force over `FRICTION_STIFFER` C_c, 0.001 mm/s per N, where eq. (19) rises to its maximum at the critical velocity. The
points' normals stay in the plane of the roller's axis where the ring tilts. Source: MuJoCo documentation,
*Computation*, "Constraint model" and "Parameters", https://mujoco.readthedocs.io/en/stable/computation.
"""

import importlib
import math
import statistics
import time
from argparse import Namespace
from collections.abc import Iterator
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry, load_bearing
from srbval.models.full.equilibrium import equilibrium_state
from srbval.models.full.parameters import Parameters, make_parameters, state_layout
from srbval.models.full.point_cloud import circle_points, inner_circle, outer_circle
from srbval.models.hierarchy import geometry_of
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.scene import Scene, paper_scene
from srbval.storage.installation import MissingLibraryError
from srbval.studies.harness import StudyResult

STEP_S = 1 / 61440  # the paper's, section 2.3
DURATION_S = 2.0  # of the runs here
KINDS, PAIRS = ("wall", "cpu"), 10
SHARE_S = 0.05  # simulated by MuJoCo in each pair
POINT_M = 1e-6  # radius of a point; a roller's spheres are smaller by it
IMPEDANCE = 0.1
FRICTION_STIFFER = 1000.0
BLOCKED_NMS = 1e6  # of the servo that drives the inner ring, per rad/s of difference


def load_mujoco() -> Any:
    """The engine; `MissingLibraryError` with what to do where it is not installed."""
    try:
        return importlib.import_module("mujoco")
    except ImportError:
        raise MissingLibraryError("the comparison with MuJoCo", "mujoco") from None


def describe(scene: Scene, geometry: SphericalRollerGeometry, model: Parameters) -> str:
    """The scene as MuJoCo's XML. Bodies: ``outer``, ``inner``, ``cage`` and in it the rollers, row 1 first."""
    rollers = "".join(_roller(model, geometry, number, angle) for number, angle in enumerate(model.slot_angle))
    outer, inner = (
        "".join(
            f'<geom class="race" pos="{_numbers(place)}" conaffinity="{circle}"/>'
            for circle, place in _points(scene, geometry, race)
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
  <body name="outer">{springs}{_inertial(model.ring_mass, "1 1 1")}{outer}</body>
  <body name="inner"><joint name="shaft" axis="0 0 1"/>{_inertial(1.0, "1 1 1")}{inner}</body>
  <body name="cage"><joint type="ball"/>{_inertial(scene.bodies.cage_mass_kg, inertia)}{rollers}</body>
</worldbody>
<actuator><velocity joint="shaft" kv="{BLOCKED_NMS}"/></actuator>
</mujoco>"""


def _roller(model: Parameters, geometry: SphericalRollerGeometry, number: int, angle: float) -> str:
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
        f'<body pos="{_numbers(model.centre_distance * out)}" xyaxes="{_numbers(out)} {_numbers(along)}">'
        '<joint type="slide" axis="1 0 0"/><joint axis="0 0 1"/>'
        f"{_inertial(model.roller_mass, inertia)}{spheres}</body>"
    )


def _inertial(mass: float, inertia: str) -> str:
    return f'<inertial pos="0 0 0" mass="{mass}" diaginertia="{inertia}"/>'


def _points(scene: Scene, geometry: SphericalRollerGeometry, race: Fault) -> Iterator[tuple[int, FloatArray]]:
    """Bit of the rollers' circle that meets it, and place of every point of a race [m], defects included."""
    outer, zone, count = race is Fault.OUTER, scene.load.zone_rad, scene.contact.points_per_circle
    for row, side in ((1, 1), (2, -1)):
        for number, p in enumerate(CIRCLES, start=1):
            circle = (outer_circle if outer else inner_circle)(geometry, p)
            defects = [d for d in scene.defects if (d.kind, d.row, d.circle) == (race, row, number)]
            points = circle_points(count, circle.radius_m, defects, zone)
            radial = circle.radius_m + points.lift * circle.normal_radial
            axial = side * (circle.height_m + points.lift * circle.normal_axial)
            bit = 1 << (number - 1 if outer else len(CIRCLES) - number)
            for place in np.stack([radial * np.cos(points.angle), radial * np.sin(points.angle), axial], axis=1):
                yield bit, place


def _numbers(values: FloatArray) -> str:
    return " ".join(repr(float(value)) for value in values)


class MujocoRun:
    """The scene in MuJoCo, from the static balance and the rolling speeds that srbval starts from too."""

    def __init__(self, scene: Scene) -> None:
        self.mujoco = load_mujoco()
        geometry = geometry_of(load_bearing(scene.bearing))
        parameters = make_parameters(scene, geometry)
        self.scene = scene
        self.model = self.mujoco.MjModel.from_xml_string(describe(scene, geometry, parameters))
        self._soften(parameters)
        self.data = self.mujoco.MjData(self.model)
        self._start(parameters)

    def _soften(self, parameters: Parameters) -> None:
        """Springs and dampers of K_c and C_c: a contact's force is (-b v - k r - a) / R, with R by the bodies' weight.

        R = (1 - d) / d w at impedance d; MuJoCo divides the b and k that it is given by d.
        """
        weight = self.model.body_invweight0[:, 0]
        for race in ("outer", "inner"):
            body = self.model.body(race).id
            given = (weight[body] + weight[-1]) * (1 - IMPEDANCE)
            of_race = self.model.geom_bodyid == body
            self.model.geom_solref[of_race] = -parameters.law.stiffness * given, -parameters.law.damping * given

    def _start(self, parameters: Parameters) -> None:
        state, layout, data = equilibrium_state(parameters), state_layout(parameters), self.data
        shaft, (cage,) = self.scene.shaft_speed_rad_s, state[layout.shaft_cage_rate]
        data.qpos[:3] = state[layout.ring]
        data.qpos[8::2] = state[layout.slide]
        data.qvel[3], data.qvel[6] = shaft, cage
        data.qvel[8::2] = state[layout.spin] - cage * parameters.tilt_cosine
        data.ctrl[0] = shaft
        load = self.scene.load
        data.qfrc_applied[:3] = [
            load.radial_n * math.cos(load.direction_rad), load.radial_n * math.sin(load.direction_rad), load.axial_n
        ]  # fmt: skip

    def advance(self, seconds: float) -> None:
        """Simulate on."""
        self.mujoco.mj_step(self.model, self.data, round(seconds / self.scene.solver.step_s))

    @property
    def cage_rad(self) -> float:
        """Angle of the cage about the shaft, between -pi and pi."""
        return 2 * math.atan2(self.data.qpos[7], self.data.qpos[4])


def compare(scene: Scene, pairs: int, progress: Progress) -> dict[str, Any]:
    """Time of a simulated second here and there in `pairs`, one first and then the other; what each run shows.

    Both on one core, kernels compiled and loaded before. srbval runs the scene each time, its static balance included;
    MuJoCo goes on with one run, `SHARE_S` in each pair. Of times on a busy machine the ratio of `cpu` is the sound one.
    """
    engine, run = MujocoRun(scene), simulate(scene, step=Step.UNCHECKED)
    engine.advance(scene.settle_s)
    angles, ring_m, touching, rows = [engine.cage_rad], list[float](), list[int](), list[dict[str, float]]()

    def here() -> None:
        nonlocal run
        run = simulate(scene, step=Step.UNCHECKED)

    sides = {"mujoco": (lambda: engine.advance(SHARE_S), SHARE_S), "srbval": (here, scene.settle_s + scene.duration_s)}
    for number in range(pairs):
        progress("simulate in MuJoCo and here", number / pairs)
        pair = {}
        for name in sorted(sides, reverse=number % 2 == 1):
            act, seconds = sides[name]
            wall_s, cpu_s = time.perf_counter(), time.process_time()
            act()
            pair[f"{name}_wall_s"] = (time.perf_counter() - wall_s) / seconds
            pair[f"{name}_cpu_s"] = (time.process_time() - cpu_s) / seconds
        rows.append(pair | {f"{kind}_ratio": pair[f"mujoco_{kind}_s"] / pair[f"srbval_{kind}_s"] for kind in KINDS})
        angles.append(engine.cage_rad)
        ring_m.append(float(np.hypot(*engine.data.qpos[:2])))
        touching.append(engine.data.ncon)
    progress("simulate in MuJoCo and here", 1.0)
    turned = (np.unwrap(angles)[-1] - angles[0]) / (scene.shaft_speed_rad_s * pairs * SHARE_S)
    own_ring_m = np.hypot(*run.displacement_m[:, :2].T)
    return {
        "pairs": rows, **{f"{kind}_ratio": statistics.median(one[f"{kind}_ratio"] for one in rows) for kind in KINDS},
        "step_s": scene.solver.step_s, "version": engine.mujoco.__version__, "touching": statistics.fmean(touching),
        "cage_ratio": {"mujoco": float(turned), "srbval": run.cage_ratio},
        "ring_m": {"mujoco": statistics.fmean(ring_m), "srbval": float(own_ring_m.mean())},
    }  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    scene = paper_scene(defect={"kind": Fault.OUTER}, solver={"step_s": STEP_S}, duration_s=DURATION_S)
    found = compare(scene, options.pairs or PAIRS, progress)
    ratios = [one["cpu_ratio"] for one in found["pairs"]]
    (cage, own_cage), (ring_m, own_ring_m) = (found[name].values() for name in ("cage_ratio", "ring_m"))
    text = (
        f"{text_rows(found['pairs'])}\n\nMuJoCo {found['version']} takes {found['cpu_ratio']:.0f} times as long at the "
        f"same step, in CPU seconds ({min(ratios):.0f} to {max(ratios):.0f}). Cage ratio {cage:.5f} there, "
        f"{own_cage:.5f} here; ring displaced by {1e6 * ring_m:.2f} um there, {1e6 * own_ring_m:.2f} um here."
    )
    return StudyResult(name="mujoco", content=found, text=text)
