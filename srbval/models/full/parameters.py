"""Parameters of the kernels: all numbers of a scene, in one named tuple of floats and arrays."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from srbval.arrays import FloatArray, IntArray
from srbval.bearing import CIRCLES, Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full import columns as col
from srbval.models.full.columns import StateLayout
from srbval.models.full.contact_kernel import ContactLaw
from srbval.models.full.frames_kernel import SurfaceHeights
from srbval.models.full.oil_kernel import OilLaw
from srbval.models.full.point_cloud import (
    Circle,
    CirclePoints,
    candidate_windows,
    circle_points,
    race_circle,
)
from srbval.models.full.slices_kernel import SliceTable
from srbval.models.outputs import DEPTH_LIMIT_M
from srbval.scene import LoadPath, RollerFit, Scene
from srbval.scene.parts import STANDARD_GRAVITY_M_S2

POCKETS = 19  # second word of the seed for the offsets in the cage's pockets
SAGITTA_SHARE = 0.98  # share of a gap that the curvature gives: axes of roller and race are not quite parallel
GAUSS_POINTS = 32  # the profiles are smooth; 32 points integrate them to rounding
YOUNG_N_M2, POISSON = 2.07e11, 0.3  # bearing steel, ISO/TS 16281
CONTACT_MODULUS_PA = YOUNG_N_M2 / (2 * (1 - POISSON**2))  # of two bodies, after Hertz
POINTS_OF_A_WAVE = 16  # angles in the shortest wave; straight lines between them miss it by 2 %
MOST_LOADED = 5.0  # largest over mean roller load of a bearing with clearance, after Stribeck; from memory


class RaceSearch(NamedTuple):
    """Constants for finding the points of one race that a roller may touch.

    `points` on a circle; `per_radian`: points per radian; `per_point`: 1 / `points`; `most`: largest number of
    neighbouring points of a circle that a roller may touch; `per_spacing`: inverse of the smallest distance of
    neighbouring points [1/m]; `per_clearance`: inverse of the smallest gap that is left at the next point when a roller
    just touches one point [1/m]; `own_middle`, `own_half`: middle and half length, counted in points, of the stretch
    that contains all points near the race's defects.
    """

    points: float
    per_radian: float
    per_point: float
    most: float
    per_spacing: float
    per_clearance: float
    own_middle: float
    own_half: float


class Races(NamedTuple):
    """Points of both raceways, outer race first, in windows: lists of the points that a roller may touch at one place.

    `points`, [2, W windows, col.POINT_ROWS, points of a window], or None if contacts are cut into slices; the last
    windows are free, for damaged rollers. `starts`, [2, W, 4]: index in a window at which each of the race's three
    circles begins, and the end; `window_of`, [2, 2 rows, points of a circle]: number of the window for a roller to
    which this point is the nearest (away from defects, the longest one); `highest`, [2, W]: largest height of the
    defects in a window [m]; `plain`: number of windows without defects, which are the first; `height`: largest distance
    of a circle from the bearing's mid-plane [m]; `outer`, `inner`: constants for finding the points.
    """

    points: Any
    starts: IntArray
    window_of: IntArray
    highest: FloatArray
    plain: int
    height: float
    outer: RaceSearch
    inner: RaceSearch


class Drive(NamedTuple):
    """Shaft speed and load over the run's time: `Scene.speed_table` and `Scene.load_table`.

    `direction_cosine`, `direction_sine`: of the angle from the x axis to the radial force.
    """

    speed: FloatArray
    load: FloatArray
    direction_cosine: float
    direction_sine: float


class Parameters(NamedTuple):
    """Parameters of the full model in SI units: geometry, bodies, contact, housing, load, drive, point clouds.

    They include the kernels' working space, so that runs at the same time must not share parameters.
    """

    # geometry
    centre_distance: float  # roller centre from the bearing centre [m]
    tilt_cosine: float
    tilt_sine: float
    race_radius: tuple[float, float]  # outer and inner profile arc [m]
    inner_centre_radial: float  # circle of centres of the inner profile [m]
    inner_centre_axial: float
    slot_angle: FloatArray  # angle of each roller in the cage, row 1 first, shape [2 M] [rad]
    # bodies
    roller_mass: float
    roller_axial: float
    roller_transverse: float
    cage_axial: float
    cage_transverse: float
    ring_mass: float
    law: ContactLaw
    # housing, load, drive
    housing_stiffness: float
    housing_damping: float
    gravity: float  # acceleration along y [m/s2]
    drive: Drive
    # raceways and rollers' surfaces
    races: Races
    roller_defects: FloatArray  # shape [D, col.DEFECT_COLUMNS]
    spare_of: IntArray  # which spare window a damaged roller has, shape [2 M]
    space: FloatArray  # working space, as `plan`: see `columns`
    plan: IntArray
    slots: int  # number of slots in `space`, a multiple of `col.LANES`, so that some may be empty
    circle_half_gap: float  # half the distance between two circles along a roller [m]
    surface: SurfaceHeights
    patch: FloatArray | None  # constants of the line model, of length 0 in the full model: see `srbval.models.line`
    second_cage: float | None = None  # moment of inertia of row 2's cage about its axis, see `second_cage_kernel`
    slices: SliceTable | None = None  # contacts cut into slices, see `srbval.models.slices`; `patch` is then None
    oil: OilLaw | None = None  # drag, rolling resistance, pockets of a bearing with slices
    free: int | None = None  # `FREE`: rollers with slices tilt and slide along their axes, see `tilt_kernel`


def make_parameters(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Assemble the kernel parameters of a scene, whose default values are those of Giraudo's Tables 1 and 4.

    Cages are modelled as thin rings at the pitch radius; their mass, an assumption, is a value of the scene.
    """
    diameter, defects = roller_diameter_m(scene, geometry), _roller_defects(scene, geometry)
    rollers, heights_m = defects[:, col.DEFECT_ROLLER].astype(int), np.abs(defects[:, col.DEFECT_HEIGHT])
    damage = np.bincount(rollers, heights_m, 2 * geometry.rollers_per_row)  # summed height of each roller's defects [m]
    roller_mass, roller_axial, roller_transverse = roller_body(geometry, diameter, scene.bodies.density_kg_m3)
    row = np.arange(geometry.rollers_per_row)
    even = np.append(row, row + scene.bodies.row_stagger) * 2 * math.pi / geometry.rollers_per_row
    place = np.random.default_rng([scene.seed, POCKETS]).uniform(-1, 1, even.size)
    angle = even + place * scene.bodies.pocket_offset_m / geometry.pitch_radius_m
    space, plan, slots = _working_space(angle)
    cage_axial = scene.bodies.cage_mass_kg * geometry.pitch_radius_m**2
    sprung, direction = scene.load.path is LoadPath.HOUSING, scene.load.direction_rad
    return Parameters(
        centre_distance=geometry.roller_centre_distance_m,
        tilt_cosine=math.cos(geometry.tilt_rad),
        tilt_sine=math.sin(geometry.tilt_rad),
        race_radius=(geometry.raceway_radius_m, geometry.raceway_radius_m),
        inner_centre_radial=geometry.inner_centre_radial_m,
        inner_centre_axial=geometry.inner_centre_axial_m,
        slot_angle=angle,
        roller_mass=roller_mass,
        roller_axial=roller_axial,
        roller_transverse=roller_transverse,
        cage_axial=cage_axial,
        cage_transverse=cage_axial / 2,
        ring_mass=geometry.outer_ring_mass_kg(scene.bodies.density_kg_m3) + scene.housing.mass_kg,
        law=ContactLaw(
            profile_radius=geometry.raceway_radius_m,
            roller_radius=diameter / 2,
            stiffness=scene.contact.stiffness_n_m,
            damping=scene.contact.damping_ns_m,
            smoothing=scene.contact.smoothing_width_m,
            static_friction=scene.contact.static_friction,
            dynamic_friction=scene.contact.dynamic_friction,
            critical_velocity=scene.contact.critical_velocity_m_s,
            onset_s=0.0,
        ),
        housing_stiffness=scene.housing.stiffness_n_m if sprung else 0.0,
        housing_damping=scene.housing.damping_ns_m,
        gravity=-STANDARD_GRAVITY_M_S2 if scene.load.gravity else 0.0,
        drive=Drive(scene.speed_table(), scene.load_table(), math.cos(direction), math.sin(direction)),
        races=_races(scene, geometry, diameter / 2, int(np.count_nonzero(damage))),
        roller_defects=defects,
        spare_of=np.cumsum(damage > 0) - 1,
        space=space,
        plan=plan,
        slots=slots,
        circle_half_gap=_axial_position(geometry, 3) / 2,
        surface=surface_heights(scene, geometry, diameter / 2),
        patch=np.zeros((2, 0, 4)),
        second_cage=cage_axial / 2 if scene.bodies.cages == 2 else None,
    )


def roller_body(geometry: SphericalRollerGeometry, diameter_m: float, density: float) -> tuple[float, float, float]:
    """Compute mass [kg] and moments of inertia about the axis and across it [kg m2] of a barrel roller.

    The roller is a solid of revolution without end chamfers or bore, with the raceway's profile arc, `diameter_m` at
    its middle, and the density rho (`density` [kg/m3]). Integrals of its radius r over the width: mass rho pi int r^2
    dz, I_a = rho pi/2 int r^4 dz about the axis, I_a/2 + rho pi int r^2 z^2 dz across it (any text on rigid bodies).
    """
    half = geometry.roller_width_m / 2
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS_POINTS)
    z, dz = half * nodes, half * weights
    radius = diameter_m / 2 - geometry.raceway_radius_m + np.sqrt(geometry.raceway_radius_m**2 - z**2)
    axial = density * math.pi / 2 * float(np.sum(radius**4 * dz))
    mass = density * math.pi * float(np.sum(radius**2 * dz))
    return mass, axial, axial / 2 + density * math.pi * float(np.sum(radius**2 * z**2 * dz))


def state_layout(model: Parameters) -> StateLayout:
    """Compute the layout of the model's state vector."""
    return StateLayout(2 * (2 * len(model.slot_angle) + col.CAGE_AND_RING + (model.second_cage is not None)))


def roller_diameter_m(scene: Scene, geometry: SphericalRollerGeometry) -> float:
    """Compute the roller diameter [m]: gap between races minus play; if roller_fit is "printed", the bearing file's."""
    if scene.contact.roller_fit is RollerFit.PRINTED:
        return geometry.roller_diameter_m
    diameter = geometry.zero_play_diameter_m - scene.contact.radial_play_m
    if not 0.9 < diameter / geometry.zero_play_diameter_m < 1.01:
        raise ConfigurationError(
            f"radial_play_m = {scene.contact.radial_play_m} must be -1 % to 10 % of the gap between the races, "
            f"{geometry.zero_play_diameter_m:.6g} m; the rest of the gap is the roller diameter, here {diameter:.6g} m."
        )
    return diameter


def _races(scene: Scene, geometry: SphericalRollerGeometry, roller_radius: float, spares: int) -> Races:
    """Build the `Races` of a scene: lists (windows) of race points, and `spares` empty lists for damaged rollers."""
    circles = [[race_circle(geometry, p, inner=inner) for p in CIRCLES] for inner in (False, True)]
    count, bumps = scene.contact.points_per_circle, sum(max(0.0, d.height_m) for d in scene.defects)
    radii = np.array([[c.radius_m for c in own] for own in circles])
    spacing = 2 * math.pi * radii / count
    # a roller that just touches a race at one point has the gap curvature x^2 / 2 to a point at the distance x
    curvature = 1 / roller_radius + np.array([[-1], [1]]) / radii
    reach = np.sqrt(2 * (DEPTH_LIMIT_M + bumps) / curvature[:, 1])  # of the deepest roller permitted
    half = max(1, *(math.floor(points + 0.5) for points in reach / spacing[:, 1]))
    next_gap = SAGITTA_SHARE * spacing**2 / 2 * curvature
    both = [
        candidate_windows(own, _place_points(scene, own, kind), count, half)
        for kind, own in zip((Fault.OUTER, Fault.INNER), circles, strict=True)
    ]
    windows = max(len(found) for found, _, _ in both) + spares
    width = max(sum(part.shape[1] for part in window) for found, _, _ in both for window in found)
    points = np.full((2, windows, col.POINT_ROWS, width), col.FAR_M)
    highest, starts = np.zeros((2, windows)), np.zeros((2, windows, 4), dtype=np.int64)
    for i, (found, _, heights) in enumerate(both):
        highest[i, : len(found)] = heights
        for j, window in enumerate(found):
            starts[i, j, 1:] = np.cumsum([part.shape[1] for part in window])
            points[i, j, :, : starts[i, j, -1]] = np.concatenate(window, axis=1)
    window_of = np.array([of_race for _, of_race, _ in both])
    least = zip(window_of, spacing.min(axis=1).tolist(), next_gap.min(axis=1).tolist(), strict=True)
    outer, inner = (race_search(of_race, 2 * half + 1, apart_m, gap_m) for of_race, apart_m, gap_m in least)
    return Races(
        points=points,
        starts=starts,
        window_of=window_of,
        highest=highest,
        plain=2 * half + 1,
        height=max(c.height_m for own in circles for c in own),
        outer=outer,
        inner=inner,
    )


def race_search(window_of: IntArray, plain: int, spacing_m: float = 1.0, next_gap_m: float = 1.0) -> RaceSearch:
    """Make the `RaceSearch` of a race; `window_of`, [rows, points], and `plain`: see `Races`.

    `spacing_m`: smallest distance of neighbouring points on a circle of the race; `next_gap_m`: smallest gap left at
    the next point when a roller just touches one. Neither has an effect in the slices model, which has no points.
    """
    count, middle, half = window_of.shape[1], 0.0, 0.0
    special = np.flatnonzero((window_of >= plain).any(axis=0))  # points near defects
    if len(special):
        gaps = np.diff(special, append=special[0] + count)
        widest = int(np.argmax(gaps))
        width = count - int(gaps[widest])
        middle, half = float(special[(widest + 1) % len(special)]) + width / 2, width / 2 + 1.0
    per = count / (2 * math.pi), 1 / count, float(plain), 1 / spacing_m, 1 / next_gap_m
    return RaceSearch(float(count), *per, own_middle=middle, own_half=half)


def _place_points(scene: Scene, circles: Sequence[Circle], kind: Fault) -> list[list[CirclePoints]]:
    """Place the points of each circle of both rows of a race (`kind`: outer or inner), displaced by its defects."""
    n, zone = scene.contact.points_per_circle, scene.load.zone_rad
    return [
        [
            circle_points(
                n, c.radius_m, [d for d in scene.defects if (d.kind, d.row, d.circle) == (kind, row, i)], zone
            )
            for i, c in enumerate(circles, start=1)
        ]
        for row in (1, 2)
    ]


def _roller_defects(scene: Scene, geometry: SphericalRollerGeometry) -> FloatArray:
    """Convert the rollers' defects to an array for the kernels, one row per defect; for its columns see `columns`."""
    rows, count = [], geometry.rollers_per_row
    for d in (d for d in scene.defects if d.kind is Fault.ROLLER):
        if d.roller > count:
            raise ConfigurationError(f"defect roller = {d.roller}: must be 1 to {count}, the rollers of a row.")
        axial = _axial_position(geometry, d.circle) * (3 - 2 * d.row)
        rows.append(((d.row - 1) * count + d.roller - 1, d.angle_rad, axial, d.height_m, d.extent_m or 0.0))
    return np.array(rows, dtype=np.float64).reshape(-1, col.DEFECT_COLUMNS)


def _axial_position(geometry: SphericalRollerGeometry, circle: int) -> float:
    """Compute where a race's circle of points, 1 to 3 from the mid-plane, meets a row-1 roller [m from its middle]."""
    return geometry.raceway_radius_m * math.sin((CIRCLES[circle - 1] - 1) * geometry.tilt_rad)


def _working_space(slot_angle: FloatArray) -> tuple[FloatArray, IntArray, int]:
    """Allocate the kernels' arrays `space` and `plan`, see `Parameters`, for rollers at these angles in the cage.

    Also returns the number of places for rollers in `space`, which is rounded up to a multiple of `col.LANES`.
    """
    count = len(slot_angle)
    slots = -(-count // col.LANES) * col.LANES
    if col.SINGLE + 2 * count * col.LANES > col.STRIDE or slots + col.LANES > col.RACE:
        raise ConfigurationError(f"rollers_per_row = {count // 2}: the full model is limited to 48 rollers per row.")
    size = col.WORKSPACE_ROWS * col.STRIDE
    whole = np.zeros(size + col.CACHE_LINE // 8)
    space = whole[-whole.ctypes.data % col.CACHE_LINE // 8 :][:size]  # no lane group lies across two cache lines
    space[int(col.O_X) : int(col.O_X) + col.STRIDE] = col.FAR_M
    both_rows = {
        col.SIDE: np.repeat([1.0, -1.0], count // 2),
        col.SLOT_ANGLE: slot_angle,
        col.SLOT_COSINE: np.cos(slot_angle),
        col.SLOT_SINE: np.sin(slot_angle),
    }
    for row, values in both_rows.items():
        space[int(row) : int(row) + count] = values.reshape(2, -1).T.ravel()
    return space, np.zeros((col.FIRST_SINGLE + 2 * count, 4), dtype=np.int64), slots


def surface_heights(scene: Scene, geometry: SphericalRollerGeometry, roller_m: float) -> SurfaceHeights:
    """Tabulate surface heights of both races and of rollers of radius `roller_m`; the tables are empty if smooth."""
    surface, rollers = scene.surface, 2 * geometry.rollers_per_row
    if surface is None:
        return SurfaceHeights(np.zeros((2, 2, 0)), np.zeros((rollers, 0)))
    circles = [race_circle(geometry, 1.0, inner=inner) for inner in (False, True)]
    load_n_m = MOST_LOADED * scene.mean_radial_n / (rollers * math.cos(geometry.tilt_rad)) / geometry.roller_width_m
    halves_m = [contact_half_m(load_n_m, 1 / roller_m + c.normal_radial / c.radius_m) for c in circles]
    bodies = [(c.radius_m, half_m, 2) for c, half_m in zip(circles, halves_m, strict=True)]
    bodies.append((roller_m, sum(halves_m) / 2, rollers))
    draw, found = np.random.default_rng(scene.seed), []
    for (radius_m, half_m, count), given_m in zip(bodies, surface.given_m, strict=True):
        orders = surface.orders(2 * math.pi * radius_m)
        felt = surface.amplitudes(2 * math.pi * radius_m, given_m) * felt_share(orders / radius_m, half_m)
        finest = surface.orders(2 * math.pi * max(radius_m, circles[0].radius_m if count == 2 else 0.0))
        size = POINTS_OF_A_WAVE * max(int(finest.max(initial=0)), 1)
        phases_rad = draw.uniform(0.0, 2 * math.pi, (count, orders.size))
        lines = np.zeros((count, size // 2 + 1), dtype=np.complex128)
        lines[:, orders.astype(int)] = felt * np.exp(1j * phases_rad) * (size / 2)
        found.append(np.fft.irfft(lines, n=size))
    return SurfaceHeights(np.array(found[:2]), found[2])


def contact_half_m(load_n_m: float, curvature_1_m: float) -> float:
    """Compute the half length b of a line contact of steel along the race [m] from the load per length `load_n_m`.

    b^2 = 4 P R / (pi E*) with the load per length P, the curvature of the gap 1 / R (`curvature_1_m`) and the contact
    modulus E* (Johnson 1985, Contact Mechanics, sect. 4.2; quoted from memory, not checked).
    """
    return math.sqrt(4 * load_n_m / (math.pi * curvature_1_m * CONTACT_MODULUS_PA))


def felt_share(per_length_1_m: FloatArray, half_m: float) -> FloatArray:
    """Compute J_0(k b), the share of a surface wave's height by which the wave moves two bodies in contact apart.

    k: the wave's phase per length along the race (`per_length_1_m` [rad/m]); b: half length of the line contact
    (`half_m`). A small height h(x) moves the bodies by its mean over the contact, weighted with the pressure of one
    additional newton, 1 / (pi sqrt(b^2 - x^2)) (Betti's reciprocity, with the derivative of Hertz's pressure over the
    load). For a wave this is J_0. Waves beyond the first zero of J_0, shorter than 2.6 b, are ignored.
    """
    from scipy.special import j0, jn_zeros

    reach = per_length_1_m * half_m
    return np.where(reach < jn_zeros(0, 1)[0], j0(reach), 0.0)
