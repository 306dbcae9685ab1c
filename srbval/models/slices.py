"""Slices model: the full model with contacts cut into slices along the roller, after ISO/TS 16281.

Only the contact differs from the full model, see "Contact cut into slices" on the page "Contact" of the theory. A
defect has its true shape, see `srbval.scene.Defect`: a drilled hole or a spall anywhere on a race or a roller. Slices
are narrower in a drilled hole.

Neglected: variation of slip within a slice, both along the race and, by pivoting about the normal, across its width;
crowned ends of rollers; support of slices by their neighbours.

Races are smooth, whereas in the full model they consist of points, over which rolling excites vibration. Two defects
that one roller touches at the same time cannot be simulated.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from srbval.arrays import FloatArray, IntArray
from srbval.bearing import Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full import columns as col
from srbval.models.full.oil_kernel import rolling_speed
from srbval.models.full.parameters import Parameters, Races, make_parameters, race_search, roller_diameter_m
from srbval.models.full.point_cloud import wrapped
from srbval.models.full.slices_kernel import SliceTable
from srbval.models.full.tilt_kernel import FREE
from srbval.models.oil import ContactShape, elliptical_films_m, film_law, oil_law, thermal_factor
from srbval.scene import Defect, DefectShape, Scene, Traction

# Stiffness c_L of 1 m of length [N/m^(10/9)]: 35948 N/mm^(10/9) for 1 mm (ISO/TS 16281), proportional to length^(8/9).
LINE_STIFFNESS = 35948.0 * 1e3 ** (8 / 9 + 10 / 9)
RACE_POSITIONS = 7200  # number of angles around a race at which a table of slices is chosen for a roller
HOLE_SLICES = 12  # number of slices across a hole
# Exponent of the slices' edges along the roller: slices are narrow in the middle, where contacts begin. Error of
# the RMS in 500 to 1500 and 1400 to 2800 Hz of 11 slices against 61 (353 rpm, healthy): 30 and 22 % with 1 as exponent,
# 6 and 13 % with 1.2, 0 and 4 % with 1.4, -3 and 5 % with 1.6.
GRADING = 1.4
MIN_LOAD_SHARE = 0.01  # share of the highest load from which a contact counts as loaded
THINNEST_M = 1e-6  # edges closer together than this count as one
LEAST_SPREAD_M = 1e-8  # least difference of penetration within a slice, if both profiles have the same radius


def slice_parameters(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Assemble the parameters of the slices model; raises `ConfigurationError` for a defect it cannot simulate."""
    own, contacts = scene.line_contact, sliced_contacts(scene, geometry)
    geometry = contacts[0].geometry
    on_rollers = [defect for defect in scene.defects if defect.kind is Fault.ROLLER]
    first, *others = on_rollers or [replace(scene.defect, kind=Fault.HEALTHY)]
    model = make_parameters(replace(scene, defect=first, further_defects=tuple(others)), geometry)
    limit = own.traction_limit
    static, dynamic, critical_ratio = {
        Traction.DRY: (model.law.static_friction, model.law.dynamic_friction, 0.0),
        Traction.LUBRICATED: (limit, limit, limit / own.traction_slope),
        Traction.FILM: (1.0, 0.0, 1.0),  # shares: `law_in_film`
    }[own.traction]
    profile = geometry.roller_profile_radius_m
    law = model.law._replace(profile_radius=profile, static_friction=static, dynamic_friction=dynamic)
    # shift of the inner arc's centre along the normal
    shift = geometry.inner_profile_radius_m - geometry.raceway_radius_m
    if len({(defect.row, defect.roller) for defect in on_rollers}) < len(on_rollers):
        raise ConfigurationError("two defects on one roller: the slices model allows one per roller; move one of them.")
    on_rollers.sort(key=lambda defect: (defect.row, defect.roller))  # in the order of the model's rollers
    film, shapes = None, [contact.shape for contact in contacts]
    if scene.oil is not None:
        model = model._replace(oil=oil_law(scene.oil, shapes, law.roller_radius))
        film = film_law(scene.oil, shapes) if own.traction is Traction.FILM else None
    outer_m, inner_m = (contact.radius_m for contact in contacts)
    selection, tables = _join_tables(contacts, scene.defects, on_rollers, model.races.height)
    return model._replace(
        free=FREE if scene.bodies.free_rollers else None,
        race_radius=(geometry.raceway_radius_m, geometry.inner_profile_radius_m),
        inner_centre_radial=model.inner_centre_radial + shift * model.tilt_cosine,
        inner_centre_axial=model.inner_centre_axial + shift * model.tilt_sine,
        law=law,
        races=selection,
        patch=None,
        slices=SliceTable(*tables, own.damping_s, critical_ratio, outer_m, inner_m, film),
    )


def sliced_contacts(scene: Scene, geometry: SphericalRollerGeometry) -> list[SlicedContact]:
    """Contacts of a roller with the outer and the inner race; osculations in the scene replace the bearing's."""
    own = scene.line_contact
    geometry = replace(
        geometry,
        outer_osculation=own.outer_osculation or geometry.outer_osculation,
        inner_osculation=own.inner_osculation or geometry.inner_osculation,
    )
    roller_m = roller_diameter_m(scene, geometry) / 2
    return [SlicedContact(scene=scene, geometry=geometry, roller_m=roller_m, inner=inner) for inner in (False, True)]


def films_m(
    scene: Scene, geometry: SphericalRollerGeometry, model: Parameters, load_n: FloatArray, cage_rad_s: float
) -> tuple[FloatArray, FloatArray]:
    """Film thickness in the middle and least film thickness of each loaded contact [m], outer race first.

    `load_n`: normal forces [N], [2 races, rollers]. The contacts are elliptical; heating of the inlet is included.
    """
    oil = scene.oil
    assert oil is not None
    rolling = rolling_speed(model.slices, cage_rad_s, scene.mean_shaft_rad_s)
    shapes = [contact.shape for contact in sliced_contacts(scene, geometry)]
    loaded = [load[load > MIN_LOAD_SHARE * load_n.max()] for load in load_n]
    both = zip(loaded, shapes, strict=True)
    films = [np.array(elliptical_films_m(oil, rolling, load, s.along_m, s.across_m)) for load, s in both]
    middle, least = np.hstack(films) * thermal_factor(oil, rolling)
    return middle, least


def _join_tables(
    contacts: list[SlicedContact], defects: Sequence[Defect], on_rollers: Sequence[Defect], height_m: float
) -> tuple[Races, tuple[FloatArray, IntArray, FloatArray, FloatArray]]:
    """Join the tables of slices of both races (`SlicedContact.tables`) into the arrays that the kernels use.

    After a race's own tables there is one for each defect of `on_rollers`, in reverse order. Returns `Races`, by which
    the kernels choose the table for a roller at each angle, and the first four fields of `SliceTable`. `height_m`: the
    field `height` of `Races`.
    """
    own = [contact.tables(defects) for contact in contacts]
    of_rollers = [[contact.slice_table(defect) for defect in on_rollers] for contact in contacts]
    count = max(len(tables) for tables, _, _ in own) + len(on_rollers)
    most = max(table.shape[1] for race in range(2) for table in (*own[race][0], *of_rollers[race]))
    joined, starts = np.zeros((2, count, col.SLICE_ROWS, most)), np.zeros((2, count, 4), dtype=np.int64)
    highest, middle, reach = np.zeros((3, 2, count))
    for race, (tables, middle_rad, _) in enumerate(own):
        highest[race, : len(tables)] = [max(0.0, float(-table[col.SLICE_FLOOR].min())) for table in tables]
        middle[race, : len(tables)] = middle_rad
        spares = ((-1 - spare, table) for spare, table in enumerate(of_rollers[race]))
        for number, table in (*enumerate(tables), *spares):
            joined[race, number, :, : table.shape[1]] = table
            # a roller touches a raised piece before its middle is above it
            raised = np.maximum(0.0, -table[col.SLICE_FLOOR]) / table[col.SLICE_SAG]
            reach[race, number] = (table[col.SLICE_HALF] + np.sqrt(raised)).max()
            ends = np.cumsum(table[col.SLICE_WIDTH])  # thirds of the length, not of the number of slices
            starts[race, number, 1:] = np.searchsorted(ends, np.array([1 / 3, 2 / 3, 1 - 1e-9]) * ends[-1]) + 1
    selection = Races(
        points=None,
        starts=np.zeros_like(starts),
        window_of=np.array([table_at for _, _, table_at in own]),
        highest=highest,
        plain=1,
        height=height_m,
        outer=race_search(own[0][2], 1),
        inner=race_search(own[1][2], 1),
    )
    return selection, (joined, starts, middle, reach)


@dataclass(frozen=True, kw_only=True)
class SlicedContact:
    """Contact between a roller of the radius `roller_m` and one race, `inner` or outer, cut into slices."""

    scene: Scene
    geometry: SphericalRollerGeometry
    roller_m: float
    inner: bool

    @property
    def profile_m(self) -> float:
        """Radius of the race's profile arc [m]."""
        return self.geometry.inner_profile_radius_m if self.inner else self.geometry.raceway_radius_m

    @property
    def radius_m(self) -> float:
        """Radius of the race about the shaft in the middle of the contact [m]."""
        return float(self.place(np.zeros(1))[0][0])

    @property
    def shape(self) -> ContactShape:
        """Curvatures of the gap in the middle of the contact, for oil films and rolling resistance."""
        across = 1 / self.geometry.roller_profile_radius_m - 1 / self.profile_m
        return ContactShape(float(self.gap_curvature_1_m(np.zeros(1))[0]), across, self.geometry.roller_width_m)

    def place(self, axial_m: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Points on the race: radius about the shaft, distance from the plane midway between both rows of rollers [m].

        Also returns the radial and axial component of the race's normal. `axial_m`: distances from the roller's middle
        along the roller, away from that plane. The races' profiles are arcs (eq. (17) of Giraudo et al. 2025).
        """
        geometry, tilt = self.geometry, self.geometry.tilt_rad
        angle = tilt + axial_m / self.profile_m
        c, s = np.cos(angle), np.sin(angle)
        if not self.inner:
            return self.profile_m * c, self.profile_m * s, -c, -s
        shift = self.profile_m - geometry.raceway_radius_m
        radial = geometry.inner_centre_radial_m + shift * math.cos(tilt) - self.profile_m * c
        return radial, geometry.inner_centre_axial_m + shift * math.sin(tilt) - self.profile_m * s, c, s

    def gap_curvature_1_m(self, axial_m: FloatArray) -> FloatArray:
        """Curvature of the gap along the race [1/m] at `axial_m` (see `place`): the roller's plus the race's."""
        profile = self.geometry.roller_profile_radius_m
        lean = np.arcsin(axial_m / profile)
        across = self.roller_m - profile + profile * np.cos(lean)
        radius, _, normal, _ = self.place(axial_m)
        curvature: FloatArray = np.cos(lean) / across + normal / radius
        return curvature

    def tables(self, defects: Sequence[Defect]) -> tuple[list[FloatArray], list[float], IntArray]:
        """Make a table of slices without defect and one for each of the `defects` on this race, see `slice_table`.

        Also returns the angle from the x axis to the middle of each table's defect [rad], 0 without defect; and the
        number of the table to use for a roller at each angle, [2 rows of rollers, RACE_POSITIONS]. Raises
        `ConfigurationError` if a roller can touch two defects at a time.
        """
        found, middles = [self.slice_table(None)], [0.0]
        table_at = np.zeros((2, RACE_POSITIONS), np.int64)
        for defect in (d for d in defects if d.kind is (Fault.INNER if self.inner else Fault.OUTER)):
            table, middle = self.slice_table(defect), self.scene.load.zone_rad + defect.angle_rad
            # a roller touches a raised piece before its middle is above it
            raised = math.sqrt(2 * max(0.0, defect.height_m) / float(self.gap_curvature_1_m(np.zeros(1))[0]))
            reach = (float(table[col.SLICE_HALF].max()) + raised) / self.radius_m + 2 * math.pi / RACE_POSITIONS
            near = np.abs(wrapped(np.arange(RACE_POSITIONS) * 2 * math.pi / RACE_POSITIONS - middle)) <= reach
            if np.any(table_at[defect.row - 1, near]):
                raise ConfigurationError(
                    f"two defects of the {defect.kind} race are so close that a roller touches both: the slices model "
                    "handles one at a time; move one of them, or put it on the other row."
                )
            table_at[defect.row - 1, near] = len(found)
            found.append(table)
            middles.append(middle)
        return found, middles, table_at

    def _slice_edges(self, defect: Defect | None) -> FloatArray:
        """Edges [m] of a contact's slices along the roller, also at the ends of a `defect`; more in a drilled hole."""
        half = self.geometry.roller_width_m / 2
        even = np.linspace(-1, 1, self.scene.line_contact.slices + 1)
        edges = half * np.sign(even) * np.abs(even) ** GRADING
        if defect is None:
            return edges
        low, high, _ = self._defect_ends(defect)
        cuts = np.linspace(low, high, HOLE_SLICES + 1 if defect.shape is DefectShape.HOLE else 2)
        outside = (edges < low - THINNEST_M) | (edges > high + THINNEST_M)
        if defect.shape is not DefectShape.HOLE:
            outside |= (edges > low + THINNEST_M) & (edges < high - THINNEST_M)
        return np.sort(np.append(edges[outside], cuts))

    def _defect_ends(self, defect: Defect) -> tuple[float, float, float]:
        """Ends of a defect along the roller, limited to the roller's ends, and the defect's middle [m]."""
        half, gap = self.geometry.roller_width_m / 2, self.geometry.raceway_radius_m * self.geometry.tilt_rad / 2
        width = defect.extent_m if defect.shape is DefectShape.HOLE else defect.width_m
        middle = defect.axial_m if defect.axial_m is not None else (defect.circle - 2) * gap
        low = max(-half, middle - (width or gap) / 2)
        high = min(half, middle + (width or gap) / 2)
        if high - low < 2 * THINNEST_M:
            raise ConfigurationError(f"defect axial_m = {middle:g} m is not on the roller (+-{half:g} m): move it.")
        return low, high, middle

    def slice_table(self, defect: Defect | None) -> FloatArray:
        """Make the table of slices at a defect, or at undamaged surfaces: [col.SLICE_ROWS constants, slices].

        The constants are, for example, place, stiffness and width of a slice, and the defect's length and height there.
        """
        edges = self._slice_edges(defect)
        middle, width = (edges[1:] + edges[:-1]) / 2, np.diff(edges)
        length = self.geometry.roller_width_m
        rows = np.zeros((col.SLICE_ROWS, len(middle)))
        radial, axial, normal_radial, normal_axial = self.place(middle)
        # the mean of an arc is closer to the roller than its middle; it determines the mean slip of a slice
        off = width**2 / 24 / self.profile_m
        rows[col.SLICE_RADIAL], rows[col.SLICE_AXIAL] = radial + off * normal_radial, axial + off * normal_axial
        rows[col.SLICE_NORMAL_RADIAL], rows[col.SLICE_NORMAL_AXIAL] = normal_radial, normal_axial
        # the formula is for the approach of both contacts, of which each has half
        rows[col.SLICE_STIFFNESS] = LINE_STIFFNESS * length ** (8 / 9) * width / length * 2 ** (10 / 9)
        rows[col.SLICE_WIDTH] = width
        bend = 1 / self.geometry.roller_profile_radius_m - 1 / self.profile_m
        rows[col.SLICE_VERTEX] = np.maximum(bend * width**2 / 4, LEAST_SPREAD_M)
        rows[col.SLICE_LIFT] = width**2 / 24 / self.geometry.roller_profile_radius_m
        rows[col.SLICE_BEND] = bend * width**2
        rows[col.SLICE_SAG] = self.gap_curvature_1_m(middle) / 2
        if defect is not None:
            low, high, centre = self._defect_ends(defect)
            inside = (middle > low) & (middle < high)
            points = defect.points * 2 * math.pi * self.radius_m / self.scene.contact.points_per_circle
            half = np.full(len(middle), (defect.extent_m if defect.extent_m is not None else points) / 2)
            if defect.shape is DefectShape.HOLE:
                half = np.sqrt(np.maximum(0.0, half**2 - (middle - centre) ** 2))
            rows[col.SLICE_HALF] = np.where(inside, half, 0.0)
            rows[col.SLICE_RAMP] = np.where(inside, defect.ramp_m, 0.0)
            rows[col.SLICE_FLOOR] = np.where(inside, -defect.height_m, 0.0)
        return rows
