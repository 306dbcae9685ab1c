"""Scene: all values on which a run of a model depends, in SI units, frozen.

Values have no defaults here: they come from `paper.toml` (Giraudo et al. 2025, Tables 4 and 5) or from a user's file.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.errors import ConfigurationError
from srbval.scene.oil import Oil
from srbval.scene.parts import Bodies, Contact, Defect, Housing, LineContact, Load, LoadProfile, SpeedProfile, Traction
from srbval.scene.sensor_path import SensorPath
from srbval.scene.surface import Surface
from srbval.storage.tables import Limited, limited, quantity

STEP_TOLERANCE = 1e-6  # largest relative difference of an output interval from a whole number of steps
MOST_PER_OUTPUT = 100_000  # steps; within an output interval a run cannot be interrupted
MOST_STEPS = 1e11  # of a run with settling; a week of computing or more
MOST_JITTER = 10.0  # beyond it passages have no order
MOST_CAGE_SLIP = 0.5
MAX_DEFECTS = 20  # each needs a table, which takes seconds to compute


@dataclass(frozen=True, kw_only=True)
class SolverSettings(Limited):
    """Time integration of a scene: name of the method and its fixed step."""

    name: str
    step_s: float = quantity("time", above=0)


def describe_step(steps_per_s: float) -> str:
    """Format the step 1 / `steps_per_s`, e.g. ``1/40960 s (2.4414063e-05)``, with enough digits to set `step_s`."""
    return f"1/{steps_per_s:.10g} s ({1 / steps_per_s:.8g})"


@dataclass(frozen=True, kw_only=True)
class Scene(Limited):
    """Simulation case: a bearing at a speed under a load, with or without a defect, and its simulation settings.

    `settle_s` is simulated first and not recorded. `output_rate_hz`: rate of the recorded signals; an output interval
    must be a whole number of solver steps. `detail_rate_hz`: rate of the detailed outputs (spins, contact loads), 0 for
    none. A profile replaces the constant speed or load and must cover the recorded time; its first value applies while
    settling. `slip_jitter`: relative standard deviation of the spacing of a defect's passages, in the impulse model;
    `cage_slip`: relative lag of the cage behind pure rolling, in models that prescribe the cage speed. `sensor_path`:
    structure between ring and sensor, None for none; it does not affect the motion. `surface`: waves of races and
    rollers, None for perfectly round ones. `oil`: None for no losses by rolling, drag and cage pockets.
    """

    bearing: str
    model: str
    shaft_speed_rad_s: float = quantity("speed", above=0)
    duration_s: float = quantity("time", above=0)
    settle_s: float = quantity("time", least=0)
    output_rate_hz: float = quantity("frequency", above=0)
    detail_rate_hz: float = quantity("frequency", least=0)
    seed: int = limited(least=0, most=2**63 - 1)
    slip_jitter: float = limited(least=0, most=MOST_JITTER)
    load: Load
    contact: Contact
    line_contact: LineContact
    housing: Housing
    bodies: Bodies
    defect: Defect
    solver: SolverSettings
    cage_slip: float = limited(least=0, most=MOST_CAGE_SLIP, default=0.0)
    further_defects: tuple[Defect, ...] = ()
    speed_profile: SpeedProfile | None = None
    load_profile: LoadProfile | None = None
    sensor_path: SensorPath | None = None
    surface: Surface | None = None
    oil: Oil | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        if len(self.further_defects) >= MAX_DEFECTS:
            raise ConfigurationError(f"scene: {1 + len(self.further_defects)} defects; the limit is {MAX_DEFECTS}.")
        if self.line_contact.traction is Traction.FILM and self.oil is None:
            raise ConfigurationError('line_contact traction = "film" needs a table [oil], for example iso_vg = 150.')
        for profile in (self.speed_profile, self.load_profile):
            if profile is not None:
                profile.check_covers(self.duration_s)
        if self.samples < 1:
            raise ConfigurationError(
                f"duration_s = {self.duration_s} is shorter than one output interval of {1 / self.output_rate_hz} s."
            )
        if self.detail_rate_hz and abs(self.outputs_per_detail * self.detail_rate_hz / self.output_rate_hz - 1) > 1e-9:
            raise ConfigurationError(
                f"detail_rate_hz = {self.detail_rate_hz:g} must divide output_rate_hz = {self.output_rate_hz:g}."
            )
        rate, settings = self.output_rate_hz, self.solver
        steps = 1 / (rate * settings.step_s)
        long = (self.settle_s + self.duration_s) / settings.step_s
        if round(steps) > MOST_PER_OUTPUT or long > MOST_STEPS:
            most = min(MOST_PER_OUTPUT, math.floor(MOST_STEPS / ((self.settle_s + self.duration_s) * rate)))
            raise ConfigurationError(
                f"step_s = {settings.step_s:g} makes {steps:.3g} steps per output interval and {long:.3g} in all; the "
                f"limits are {MOST_PER_OUTPUT} and {MOST_STEPS:g}: "
                + (f"the shortest step here is {describe_step(most * rate)}." if most else "shorten the run.")
            )
        if round(steps) < 1 or abs(steps / round(steps) - 1) > STEP_TOLERANCE:
            below = math.floor(steps)
            fit = ", ".join(describe_step(n * rate) for n in sorted({1, max(1, below), below + 1}))
            raise ConfigurationError(
                f"the output interval 1/{rate:g} s is {steps:.6g} steps of {settings.step_s:g} s; it must be a whole "
                f"number: change step or output_rate. Steps that fit, the longest and those near this one: {fit}."
            )

    @property
    def shaft_hz(self) -> float:
        """Mean shaft speed over the recorded time [Hz]."""
        return self.mean_shaft_rad_s / (2 * math.pi)

    @property
    def mean_shaft_rad_s(self) -> float:
        """Mean shaft speed over the recorded time [rad/s]."""
        profile = self.speed_profile
        return self.shaft_speed_rad_s if profile is None else profile.mean(profile.speed_rad_s, self.duration_s)

    @property
    def mean_radial_n(self) -> float:
        """Mean radial load over the recorded time [N]."""
        profile = self.load_profile
        return self.load.radial_n if profile is None else profile.mean(profile.radial_n, self.duration_s)

    def speed_table(self) -> FloatArray:
        """Motion of the shaft, [3, k]: time [s], speed [rad/s] and angle [rad]; a constant speed has one entry.

        The speed is linear between the entries. Time 0 is the start of the run, `settle_s` before the recorded time.
        """
        time, speed = np.zeros(1), np.array([self.shaft_speed_rad_s])
        if (profile := self.speed_profile) is not None:
            time, speed = np.array(profile.time_s) + self.settle_s, np.array(profile.speed_rad_s)
        angle = np.append(0.0, np.cumsum(np.diff(time) * (speed[1:] + speed[:-1]) / 2)) + speed[0] * time[0]
        return np.stack([time, speed, angle])

    def load_table(self) -> FloatArray:
        """Loads over the run's time, [3, k]: time [s], radial and axial force [N]; entries as in `speed_table`."""
        if (profile := self.load_profile) is None:
            return np.array([[0.0], [self.load.radial_n], [self.load.axial_n]])
        return np.array([np.array(profile.time_s) + self.settle_s, profile.radial_n, profile.axial_n])

    @property
    def defects(self) -> tuple[Defect, ...]:
        """Defects of the scene; empty for a healthy bearing."""
        return tuple(d for d in (self.defect, *self.further_defects) if d.kind is not Fault.HEALTHY)

    @property
    def outputs_per_detail(self) -> int:
        """Number of output intervals from one detailed output to the next; 0 if there are none."""
        return round(self.output_rate_hz / self.detail_rate_hz) if self.detail_rate_hz else 0

    @property
    def steps_per_output(self) -> int:
        """Number of solver steps in one output interval."""
        return round(1 / (self.output_rate_hz * self.solver.step_s))

    @property
    def samples(self) -> int:
        """Number of recorded samples."""
        return round(self.duration_s * self.output_rate_hz)


def with_points(scene: Scene, points: int) -> Scene:
    """Copy a scene with another number of contact points on each circle around a race, for models with such points.

    The stiffness and damping of all points together, and the length of each defect, stay the same.
    """
    own, factor = scene.contact, points / scene.contact.points_per_circle

    def same_length(defect: Defect) -> Defect:
        in_points = defect.extent_m is None
        return replace(defect, points=max(1, round(factor * defect.points))) if in_points else defect

    stiffness, damping = own.stiffness_n_m / factor, own.damping_ns_m / factor
    contact = replace(own, points_per_circle=points, stiffness_n_m=stiffness, damping_ns_m=damping)
    further = tuple(map(same_length, scene.further_defects))
    return replace(scene, contact=contact, defect=same_length(scene.defect), further_defects=further)
