"""An output rate no higher than the question's band needs: proven on a short run of the scene, then taken."""

from __future__ import annotations

from dataclasses import replace

from srbval.bench.ladder.questions import Question
from srbval.models.run import Run
from srbval.models.simulate import simulate
from srbval.plan.plan import Plan
from srbval.plan.reduction import Reduction, difference, good, judged, saving_pct, short_scene
from srbval.scene import Scene
from srbval.validation.pipeline import SIMULATED_BAND_HZ

SAMPLES_PER_PERIOD = 3.0  # of the band's upper edge, that a coarser output rate leaves
NAME = "coarser output"
WORTH = 3.0  # times the trial's length that a run must be to gain by it


def with_coarser_output(scene: Scene, plan: Plan) -> tuple[Scene, Reduction]:
    """`scene`, its model chosen, with the output that `plan`'s question needs; as it is where that is not proven.

    The tolerance must hold the rung's predicted error and what the coarser output adds to it.
    """
    predicted = next(c.error_pct for c in plan.candidates if c.model == plan.chosen)
    if predicted is None or plan.outside or not plan.met:
        return scene, _not_taken("the model's own error is not known to leave room for it")
    if scene.detail_rate_hz:
        return scene, _not_taken("the detailed outputs are at a rate of their own")
    short = short_scene(scene, model=scene.model)
    if scene.duration_s < WORTH * short.duration_s:
        return scene, _not_taken(
            f"not tried: to prove it {short.duration_s:.3g} s must be simulated, the run has {scene.duration_s:g} s"
        )
    found = coarser_output(good(simulate(short)), short, plan.question, plan.tolerance_pct - predicted)
    return (_coarse(scene) if found.taken else scene), found


def coarser_output(run: Run, scene: Scene, question: Question, tolerance_pct: float) -> Reduction:
    """Try it on a run of `scene`: the means of several intervals are what a coarser rate records."""
    times = _times(scene)
    if times < 2:
        return _not_taken(f"{scene.output_rate_hz:g} Hz leave no room above the band's {SIMULATED_BAND_HZ[1]:g} Hz")
    kept = run.samples // times
    coarse = replace(
        run,
        scene=replace(_coarse(scene), duration_s=kept * times / scene.output_rate_hz),
        samples=kept,
        acceleration_m_s2=run.acceleration_m_s2[: kept * times].reshape(kept, times, 3).mean(axis=1),
        cage_rad_s=run.cage_rad_s[: kept * times].reshape(kept, times).mean(axis=1),
    )
    name = f"output at {scene.output_rate_hz / times:g} Hz"
    found = judged(name, difference(coarse, run, question), tolerance_pct)
    saves = saving_pct(scene, _coarse(scene))
    why = f"{found.why}; saves {saves:.0f} % of the time, {100 - 100 / times:.0f} % of memory and file"
    return replace(found, why=why, saves_pct=saves)


def _times(scene: Scene) -> int:
    return int(scene.output_rate_hz / (SAMPLES_PER_PERIOD * SIMULATED_BAND_HZ[1]))


def _coarse(scene: Scene) -> Scene:
    return replace(scene, output_rate_hz=scene.output_rate_hz / _times(scene))


def _not_taken(why: str) -> Reduction:
    return Reduction(name=NAME, taken=False, difference_pct=None, why=why)
