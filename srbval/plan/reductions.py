"""What a scene can do without: reductions of the full model, found and proven on the scene itself.

Each is tried on a short run of the scene. Those that the kernels take by themselves (points that cannot touch, rollers
that carry nothing) are counted; a coarser output is taken where the question's answer stays (`plan.output`); those that
would need kernels of their own are held against what the run shows and what they could save, and not taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from srbval.bearing import SphericalRollerGeometry
from srbval.bench.ladder.questions import Question
from srbval.bench.touching import count_touching
from srbval.models.run import Run
from srbval.models.simulate import simulate
from srbval.plan.output import coarser_output
from srbval.plan.reduction import Reduction, difference, good, judged, saving_pct, short_scene
from srbval.scene import Scene

if TYPE_CHECKING:
    from srbval.models.full.parameters import Parameters

DETAILS_PER_S = 512.0
HEAVY_KG_M2 = 1e6  # a cage that cannot tilt
MIRRORED = 0.01  # rows whose loads differ by less are each other's mirror image
STILL = 0.01  # axial vibration below this share of the radial one is none


def find_reductions(scene: Scene, *, question: Question, tolerance_pct: float) -> tuple[Reduction, ...]:
    """Try every reduction on a short full run of `scene`; `NumericsError` where that fails.

    A difference is that between two runs of the scene, so chance is in it where rollers rattle.
    """
    short = short_scene(scene, model="full")
    divided = short.output_rate_hz / max(1, round(short.output_rate_hz / DETAILS_PER_S))
    run = good(simulate(replace(short, detail_rate_hz=divided)))
    return tuple(_tried(run, short, question, tolerance_pct))


def _tried(run: Run, scene: Scene, question: Question, tolerance_pct: float) -> Iterator[Reduction]:
    touching = count_touching(run)
    points = 2 * 3 * 2 * scene.contact.points_per_circle
    rollers = run.load_n.shape[2]
    yield Reduction(
        name="points that cannot touch", taken=True, difference_pct=0.0,
        why=f"{touching.points:.0f} of {points * rollers // 2} pairs of a point and a roller touch; "
        "the kernels look at those within reach only",
    )  # fmt: skip
    yield Reduction(
        name="unloaded rollers", taken=True, difference_pct=0.0,
        why=f"{touching.contacts:.0f} of {2 * rollers} pairs of a roller and a race touch; "
        "the kernels leave eights of rollers out that touch nothing",
    )  # fmt: skip
    yield coarser_output(run, scene, question, tolerance_pct)
    yield _locked_tilts(run, scene, question, tolerance_pct)
    yield _second_row(run, scene)
    yield _no_axial_motion(run)


def _locked_tilts(run: Run, scene: Scene, question: Question, tolerance_pct: float) -> Reduction:
    from srbval.models.full.parameters import make_parameters

    def stiff(own: Scene, geometry: SphericalRollerGeometry) -> Parameters:
        return make_parameters(own, geometry)._replace(cage_transverse=HEAVY_KG_M2)

    locked = good(simulate(scene, make=stiff))
    tilt = 1e6 * float(np.abs(run.cage_tilt_rad).max())
    found = judged("locked cage tilts", difference(locked, run, question), tolerance_pct)
    share = 100 * 2 / _coordinates(run)
    why = (
        f"{found.why}; the cage tilts by up to {tilt:.3g} urad. Two coordinates of {_coordinates(run)}, {share:.2g} %: "
        "it saves time only in kernels of its own, and no more than that"
    )
    return replace(found, taken=False, why=why)


def _second_row(run: Run, scene: Scene) -> Reduction:
    """Row 2 is row 1 mirrored at the mid-plane; what that could save is timed with half of the rollers."""
    half = run.load_n.shape[2] // 2
    first, second = run.load_n[:, :, :half], run.load_n[:, :, half:]
    apart = float(np.abs(first.sum(axis=3) - second.sum(axis=3)).max() / run.load_n.sum(axis=3).max())
    why = f"the rows' loads differ by up to {100 * apart:.2g} % of the largest"
    if apart > MIRRORED:
        return Reduction(
            name="second row by symmetry", taken=False, difference_pct=None,
            why=f"{why}; more than {100 * MIRRORED:g} %",
        )  # fmt: skip
    saves = saving_pct(scene, scene, make=_half_as_many)
    return Reduction(
        name="second row by symmetry", taken=False, difference_pct=None, saves_pct=saves,
        why=f"{why}; it would save {saves:.0f} % of the time, timed with half of the rollers, in kernels of its own "
        "that hold the ring's middle plane",
    )  # fmt: skip


def _half_as_many(scene: Scene, geometry: SphericalRollerGeometry) -> Parameters:
    """Half of the rollers under half of the load: what a model of one row would compute."""
    from srbval.models.full.parameters import make_parameters

    half = make_parameters(scene, replace(geometry, rollers_per_row=-(-geometry.rollers_per_row // 2)))
    load = half.drive.load.copy()
    load[1:] /= 2
    return half._replace(
        ring_mass=half.ring_mass / 2,
        housing_stiffness=half.housing_stiffness / 2,
        housing_damping=half.housing_damping / 2,
        drive=half.drive._replace(load=load),
    )


def _no_axial_motion(run: Run) -> Reduction:
    axial, radial = (float(run.acceleration_m_s2[:, i].std()) for i in (2, 1))
    share = axial / radial if radial else 0.0
    why = f"the ring's axial vibration is {100 * share:.3g} % of the radial one"
    needs = f"more than {100 * STILL:g} %"
    if share <= STILL:
        needs = (
            f"one coordinate of {_coordinates(run)}: it saves time only in kernels of its own, and no more than "
            f"{100 / _coordinates(run):.2g} %"
        )
    return Reduction(name="no axial motion", taken=False, difference_pct=None, why=f"{why}; {needs}")


def _coordinates(run: Run) -> int:
    """Free coordinates: slide and spin of each roller, three turns of the cage, three ways of the ring."""
    return 2 * run.load_n.shape[2] + 6
