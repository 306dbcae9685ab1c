"""What a scene can do without: reductions of the full model, found and proven on the scene itself.

Each is tried on a short run of the scene. Those that the kernels take by themselves (points that cannot touch, rollers
that carry nothing) are counted; those that can be taken from outside are taken, and the question asked again; those
that would need kernels of their own are held against what the run shows, and not taken.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from srbval.bearing import SphericalRollerGeometry, load_bearing
from srbval.bench.ladder.questions import Question, answers, error_pct
from srbval.bench.touching import count_touching
from srbval.errors import NumericsError
from srbval.models.run import Run, RunStatus
from srbval.models.simulate import simulate
from srbval.scene import Scene
from srbval.validation.pipeline import SIMULATED_BAND_HZ

SECONDS = 1.0
LEAST_REVOLUTIONS = 10
DETAILS_PER_S = 512.0
SAMPLES_PER_PERIOD = 3.0  # of the band's upper edge, that a coarser output rate leaves
HEAVY_KG_M2 = 1e6  # a cage that cannot tilt
MIRRORED = 0.01  # rows whose loads differ by less are each other's mirror image
STILL = 0.01  # axial vibration below this share of the radial one is none


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """One reduction: is it taken, what it changes in the question's answer [%] where that was tried, and why."""

    name: str
    taken: bool
    difference_pct: float | None
    why: str

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def find_reductions(scene: Scene, *, question: Question, tolerance_pct: float) -> tuple[Reduction, ...]:
    """Try every reduction on a short full run of `scene`; `NumericsError` where that fails.

    A difference is that between two runs of the scene, so chance is in it where rollers rattle.
    """
    short = replace(
        scene, model="full", speed_profile=None, load_profile=None, detail_rate_hz=0.0,
        duration_s=max(SECONDS, LEAST_REVOLUTIONS / scene.shaft_hz),
    )  # fmt: skip
    divided = short.output_rate_hz / max(1, round(short.output_rate_hz / DETAILS_PER_S))
    run = _good(simulate(replace(short, detail_rate_hz=divided)))
    return tuple(_tried(run, short, question, tolerance_pct))


def _good(run: Run) -> Run:
    if run.status is not RunStatus.OK:
        raise NumericsError(f"run failed ({run.status}): {run.reason}.")
    return run


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
    yield _coarser_output(run, scene, question, tolerance_pct)
    yield _locked_tilts(run, scene, question, tolerance_pct)
    yield _second_row(run, rollers)
    yield _no_axial_motion(run)


def _coarser_output(run: Run, scene: Scene, question: Question, tolerance_pct: float) -> Reduction:
    """Means of several intervals are what a coarser output rate records."""
    times = int(scene.output_rate_hz / (SAMPLES_PER_PERIOD * SIMULATED_BAND_HZ[1]))
    name = f"output at {scene.output_rate_hz / max(times, 1):g} Hz"
    if times < 2:
        return Reduction(
            name="coarser output", taken=False, difference_pct=None,
            why=f"{scene.output_rate_hz:g} Hz leave no room above the band's {SIMULATED_BAND_HZ[1]:g} Hz",
        )  # fmt: skip
    kept = run.samples // times
    coarse = replace(
        run,
        scene=replace(
            scene, output_rate_hz=scene.output_rate_hz / times, duration_s=kept * times / scene.output_rate_hz
        ),
        samples=kept,
        acceleration_m_s2=run.acceleration_m_s2[: kept * times].reshape(kept, times, 3).mean(axis=1),
        cage_rad_s=run.cage_rad_s[: kept * times].reshape(kept, times).mean(axis=1),
    )
    return _judged(name, _difference(coarse, run, question), tolerance_pct)


def _locked_tilts(run: Run, scene: Scene, question: Question, tolerance_pct: float) -> Reduction:
    from srbval.models.full.parameters import Parameters, make_parameters

    def stiff(own: Scene, geometry: SphericalRollerGeometry) -> Parameters:
        return make_parameters(own, geometry)._replace(cage_transverse=HEAVY_KG_M2)

    locked = _good(simulate(scene, make=stiff))
    tilt = 1e6 * float(np.abs(run.cage_tilt_rad).max())
    found = _judged("locked cage tilts", _difference(locked, run, question), tolerance_pct)
    saving = (
        f"; the cage tilts by up to {tilt:.3g} urad. Saves two of 82 coordinates, and time only in kernels of its own"
    )
    return replace(found, taken=False, why=found.why + saving)


def _second_row(run: Run, rollers: int) -> Reduction:
    """Row 2 is row 1 mirrored at the mid-plane."""
    first, second = run.load_n[:, :, : rollers // 2], run.load_n[:, :, rollers // 2 :]
    apart = float(np.abs(first.sum(axis=3) - second.sum(axis=3)).max() / run.load_n.sum(axis=3).max())
    mirrored = apart <= MIRRORED
    why = f"the rows' loads differ by up to {100 * apart:.2g} % of the largest"
    needs = "it would halve the contacts in kernels of its own" if mirrored else f"more than {100 * MIRRORED:g} %"
    return Reduction(name="second row by symmetry", taken=False, difference_pct=None, why=f"{why}; {needs}")


def _no_axial_motion(run: Run) -> Reduction:
    axial, radial = (float(run.acceleration_m_s2[:, i].std()) for i in (2, 1))
    share = axial / radial if radial else 0.0
    still = share <= STILL
    why = f"the ring's axial vibration is {100 * share:.3g} % of the radial one"
    needs = "three coordinates fewer in kernels of its own" if still else f"more than {100 * STILL:g} %"
    return Reduction(name="no axial motion", taken=False, difference_pct=None, why=f"{why}; {needs}")


def _difference(own: Run, right: Run, question: Question) -> float | None:
    bearing = load_bearing(right.scene.bearing)
    return error_pct(question, answers(own, bearing).get(question), answers(right, bearing).get(question))


def _judged(name: str, difference_pct: float | None, tolerance_pct: float) -> Reduction:
    if difference_pct is None:
        return Reduction(name=name, taken=False, difference_pct=None, why="the question has no answer with it")
    kept = difference_pct <= tolerance_pct
    why = f"changes the answer by {difference_pct:.3g} %, {'within' if kept else 'beyond'} {tolerance_pct:g} %"
    return Reduction(name=name, taken=kept, difference_pct=difference_pct, why=why)
