"""An output rate no higher than the question's band needs: tried on a short run of the scene, then used."""

from dataclasses import dataclass, replace

from srbval.bearing import load_bearing
from srbval.errors import NumericsError
from srbval.models.run import Run
from srbval.models.simulate import Step, simulate
from srbval.plan.plan import Plan
from srbval.plan.questions import Question, answers, error_pct
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import Scene

SAMPLES_PER_PERIOD = 3.0  # of the band's upper edge, at the coarser output rate
NAME = "coarser output"
TRIAL_S, LEAST_REVOLUTIONS = 1.0, 10  # length of the short run
WORTHWHILE = 3.0  # times the length of the short run: a shorter scene gains less than the trial costs
TIMED_S, REPEATS = 0.1, 3


@dataclass(frozen=True, kw_only=True)
class Reduction:
    """A reduction of a scene: whether it is taken, how much it changes the question's answer [%], and why.

    `difference_pct` is None where it was not tried; `saves_pct` of the wall time, where that was measured.
    """

    name: str
    taken: bool
    difference_pct: float | None
    why: str
    saves_pct: float | None = None


def with_coarser_output(scene: Scene, plan: Plan) -> tuple[Scene, Reduction]:
    """`scene`, its model chosen, at the output rate that `plan`'s question needs; unchanged where a trial fails.

    The tolerance must hold the rung's predicted error and what the coarser output adds to it.
    """
    predicted = next(c.error_pct for c in plan.candidates if c.model == plan.chosen)
    if predicted is None or plan.outside or not plan.met:
        return scene, _not_taken("the model's own error is not known to leave room for it")
    if scene.detail_rate_hz:
        return scene, _not_taken("the detailed outputs are at a rate of their own")
    short = _short_scene(scene)
    if scene.duration_s < WORTHWHILE * short.duration_s:
        return scene, _not_taken(
            f"not tried: the trial must simulate {short.duration_s:.3g} s, the run has {scene.duration_s:g} s"
        )
    found = _tried(short, plan.question, plan.tolerance_pct - predicted)
    return (_coarse(scene) if found.taken else scene), found


def find_reductions(scene: Scene, *, question: Question, tolerance_pct: float) -> tuple[Reduction, ...]:
    """What the full model can do without on `scene`, each tried on a short run; `NumericsError` where that fails."""
    return (_tried(replace(_short_scene(scene), model="full"), question, tolerance_pct),)


def _short_scene(scene: Scene) -> Scene:
    """A second of the scene, or some revolutions, at its first speed and load."""
    return replace(
        scene, speed_profile=None, load_profile=None, detail_rate_hz=0.0,
        duration_s=max(TRIAL_S, LEAST_REVOLUTIONS / scene.shaft_hz),
    )  # fmt: skip


def _tried(scene: Scene, question: Question, tolerance_pct: float) -> Reduction:
    """Compare a run of `scene` with its own means over several output intervals, which a coarser rate records."""
    ratio = _ratio(scene)
    if ratio < 2:
        return _not_taken(f"{scene.output_rate_hz:g} Hz leave no room above the band's {SIMULATED_BAND_HZ[1]:g} Hz")
    run = simulate(scene, step=Step.UNCHECKED)
    if not run.status.usable:
        raise NumericsError(f"run failed ({run.status}): {run.reason}.")
    name = f"output at {scene.output_rate_hz / ratio:g} Hz"
    bearing = load_bearing(scene.bearing)
    own, right = (answers(r, bearing).get(question) for r in (_averaged(run, ratio), run))
    difference = error_pct(question, own, right)
    if difference is None:
        return Reduction(name=name, taken=False, difference_pct=None, why="the question has no answer with it")
    saves = _saving_pct(scene)
    taken = difference <= tolerance_pct
    return Reduction(
        name=name, taken=taken, difference_pct=difference, saves_pct=saves,
        why=f"changes the answer by {difference:.3g} %, {'within' if taken else 'beyond'} {tolerance_pct:.3g} %; "
        f"saves {saves:.0f} % of the time, {100 - 100 / ratio:.0f} % of memory and file",
    )  # fmt: skip


def _averaged(run: Run, ratio: int) -> Run:
    """The run with the means of `ratio` output intervals each."""
    samples = run.samples // ratio
    used = samples * ratio
    return replace(
        run,
        scene=replace(_coarse(run.scene), duration_s=used / run.scene.output_rate_hz),
        samples=samples,
        acceleration_m_s2=run.acceleration_m_s2[:used].reshape(samples, ratio, 3).mean(axis=1),
        cage_rad_s=run.cage_rad_s[:used].reshape(samples, ratio).mean(axis=1),
    )


def _saving_pct(scene: Scene) -> float:
    """Wall time that the coarser output saves of a short run of `scene` [%]; the best of some repeats each."""
    fine, coarse = (replace(s, duration_s=TIMED_S, settle_s=0.0) for s in (scene, _coarse(scene)))
    pairs = [
        (simulate(fine, step=Step.UNCHECKED).wall_s, simulate(coarse, step=Step.UNCHECKED).wall_s)
        for _ in range(REPEATS)
    ]
    before, after = (min(walls) for walls in zip(*pairs, strict=True))
    return 100 * (1 - after / before)


def _ratio(scene: Scene) -> int:
    """Output intervals in one of the coarser rate; below 2 there is none."""
    return int(scene.output_rate_hz / (SAMPLES_PER_PERIOD * SIMULATED_BAND_HZ[1]))


def _coarse(scene: Scene) -> Scene:
    return replace(scene, output_rate_hz=scene.output_rate_hz / _ratio(scene))


def _not_taken(why: str) -> Reduction:
    return Reduction(name=NAME, taken=False, difference_pct=None, why=why)
