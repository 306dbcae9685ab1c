"""The full model with contacts cut into slices along the roller, after ISO/TS 16281: the bearing as it is built.

Same bodies, joints, load and solvers; only the contact differs. Rollers and raceways have profile radii of their own
(osculation), so that a contact is longest under load and its ends carry little; each slice of it gives way as a line
contact of steel does, see `slices_kernel`, with q = c_L delta^(10/9), delta the approach over both of a roller's
contacts and c_L = 35948 L^(8/9) N/mm^(10/9) (ISO/TS 16281:2008). One of the two takes half the approach.
Friction acts on each slice with its own slip: dry, eq. (19), or lubricated, where it rises with the slide-to-roll ratio
to a limit.

Openings of true shape, see `srbval.scene.Defect`: a drilled hole or a spall anywhere on a race or a roller. Slices are
finer there.

Left out: slip within a slice's contact along the race, and what pivoting about the normal adds to it across its width;
crowned ends; that slices support each other.

Answers: all questions. Cannot answer: how points passing excite, which no raceway has; two defects that one roller
meets at a time.
"""

from dataclasses import replace

import numpy as np

from srbval.bearing import Fault, SphericalRollerGeometry
from srbval.errors import ConfigurationError
from srbval.models.full import columns as col
from srbval.models.full.parameters import Parameters, Races, RaceSearch, make_parameters, own_stretch, roller_diameter_m
from srbval.models.full.slices_kernel import SliceTable
from srbval.models.sliced_contact import Openings, SlicedContact
from srbval.scene import Scene, Traction


def slice_parameters(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Assemble the kernel parameters; `ConfigurationError` for a defect that the model does not have."""
    own = scene.line_contact
    geometry = replace(
        geometry,
        outer_osculation=own.outer_osculation or geometry.outer_osculation,
        inner_osculation=own.inner_osculation or geometry.inner_osculation,
    )
    on_rollers = [defect for defect in scene.defects if defect.kind is Fault.ROLLER]
    first, *others = on_rollers or [replace(scene.defect, kind=Fault.HEALTHY)]
    model = make_parameters(replace(scene, defect=first, further_defects=tuple(others)), geometry)
    law = model.law._replace(profile_radius=geometry.roller_profile_radius_m)
    critical_ratio = 0.0
    if own.traction is Traction.LUBRICATED:
        critical_ratio = own.traction_limit / own.traction_slope
        law = law._replace(static_friction=own.traction_limit, dynamic_friction=own.traction_limit)
    shift = geometry.inner_profile_radius_m - geometry.raceway_radius_m  # of the inner arc's centre, along the normal
    contacts = [
        SlicedContact(
            geometry=geometry, line=own, roller_m=roller_diameter_m(scene, geometry) / 2, inner=inner,
            zone_rad=scene.load.zone_rad, points_per_circle=scene.contact.points_per_circle,
        )
        for inner in (False, True)
    ]  # fmt: skip
    if len({(defect.row, defect.roller) for defect in on_rollers}) < len(on_rollers):
        raise ConfigurationError("two defects of one roller: the slices model handles one of each; move one of them.")
    on_rollers.sort(key=lambda defect: (defect.row, defect.roller))  # as the model numbers its rollers
    races = [contact.openings(scene.defects, on_rollers) for contact in contacts]
    return model._replace(
        race_radius=(geometry.raceway_radius_m, geometry.inner_profile_radius_m),
        inner_centre_radial=model.inner_centre_radial + shift * model.tilt_cosine,
        inner_centre_axial=model.inner_centre_axial + shift * model.tilt_sine,
        law=law,
        races=_races(races, model.races.height, len(on_rollers)),
        patch=np.zeros((2, 0, 4)),
        slices=_table(
            races, own.damping_s, critical_ratio, [contact.radius_m for contact in contacts], len(on_rollers)
        ),
    )


def _table(
    races: list[Openings], damping_s: float, critical_ratio: float, radius_m: list[float], on_rollers: int
) -> SliceTable:
    """Rows of all windows of both races side by side; those of the damaged rollers at the end, the first one last."""
    windows = max(len(race.rows) for race in races) + on_rollers
    most = max(rows.shape[1] for race in races for rows in (*race.rows, *race.of_rollers))
    table, middle, reach = np.zeros((2, windows, col.SLICE_ROWS, most)), np.zeros((2, windows)), np.zeros((2, windows))
    starts = np.zeros((2, windows, 4), dtype=np.int64)
    for i, race in enumerate(races):
        middle[i, : len(race.rows)] = race.middle_rad
        places = [*enumerate(race.rows), *((windows - 1 - spare, rows) for spare, rows in enumerate(race.of_rollers))]
        for window, rows in places:
            table[i, window, :, : rows.shape[1]] = rows
            # a raised piece is met before the roller stands on it
            raised = np.maximum(0.0, -rows[col.SLICE_FLOOR]) / rows[col.SLICE_SAG]
            reach[i, window] = (rows[col.SLICE_HALF] + np.sqrt(raised)).max()
            ends = np.cumsum(rows[col.SLICE_WIDTH])  # by length, so that a window with finer slices has them too
            starts[i, window, 1:] = [np.searchsorted(ends, share * ends[-1]) + 1 for share in (1 / 3, 2 / 3, 1 - 1e-9)]
    return SliceTable(table, starts, middle, reach, damping_s, critical_ratio, *radius_m)


def _races(races: list[Openings], height_m: float, on_rollers: int) -> Races:
    """What the search for candidates needs: each roller meets one contact, and one of its own near an opening."""
    search = [RaceSearch(1.0, 1.0, *own_stretch(race.window_of, 1)) for race in races]
    windows = max(len(race.rows) for race in races) + on_rollers
    highest = np.zeros((2, windows))
    for i, race in enumerate(races):
        highest[i, : len(race.rows)] = [max(0.0, float(-rows[col.SLICE_FLOOR].min())) for rows in race.rows]
    return Races(
        points=np.zeros((2, windows, col.POINT_ROWS, 0)), starts=np.zeros((2, windows, 4), dtype=np.int64),
        window_of=np.array([race.window_of for race in races]), highest=highest, plain=1, height=height_m,
        outer=search[0], inner=search[1],
    )  # fmt: skip
