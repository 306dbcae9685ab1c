"""Estimated error that a run's step leaves in its answers, and the step that keeps it within the tolerances.

The method is on the page "Time integration" of the theory, "The error that a step leaves". Its sources: the
delete-one-block jackknife of Efron & Tibshirani, An Introduction to the Bootstrap, 1993, chapter 11, and Kish's
effective sample size, Survey Sampling, 1965, section 8.2, both quoted from memory and not checked."""

import math
import time
from dataclasses import replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.estimates import BLOCKS, FINER, Estimate, StepError
from srbval.models.full_run import FullRun, full_run
from srbval.models.hierarchy import level_of
from srbval.models.run_statistics import RunningSums, RunStatistics
from srbval.models.sensor import along_sensor, band_squares
from srbval.models.step_limits import elastic_limit_s
from srbval.scene import BANDS_HZ, Scene

BlockMeans = dict[str, FloatArray]  # means of samples (of squares for bands), [BLOCKS], by quantity
CAGE, DRIVE_POWER = "mean cage speed", "drive power"  # beside the RMS in each band
KINDS = {CAGE: "cage", DRIVE_POWER: "drive_power"}  # the others are of kind "band_rms"
# Added to the means that are compared (squares of a band's): levels of no interest. Accelerometers of industrial
# make show 1e-4 m/s2 of noise in such a band and more; rollers that touch nothing leave 1e-11, which is rounding.
LEAST = {"cage": 0.0, "band_rms": 1e-4**2, "drive_power": 1e-3}  # -, (m/s2)^2, W
LEAST_BLOCKS = 4  # blocks that carry a band's power; if fewer do, knocks carry it and blocks are compared one by one
MOST_FINER = 8  # steps in one of the scene's: a run that nobody asked to be finer costs no more
PIECE_S = 0.15  # both pieces cost five times that: 8 % of a ten-second run, 10 % where a quarter of the step is taken
LONGER = 4.0  # times that, of a step to be chosen if chance hides its errors: a third of a ten-second run
PASSAGES = 4.0  # least number of roller passages over a point of the outer race in a piece
LONGEST_S = 1.0  # longest piece: at slow shafts it has fewer passages
SETTLED = 0.25  # share of a piece in which the finer step's own motion settles
LEAST_S = 0.02  # shortest piece whose bands are compared


def check_step(stats: RunStatistics, *, choose: bool) -> None:
    """Enter the step's error in `stats`, or `choose` a step, and the time it took; kernels are loaded first."""
    scene, started = stats.scene, time.perf_counter()
    full_run(scene, stats.bearing).advance(0, 0)
    stats.compile_s, started = stats.compile_s + time.perf_counter() - started, time.perf_counter()
    with np.errstate(all="ignore"):
        if choose:
            stats.scene, error = with_chosen_step(scene, stats.bearing)
        else:
            error = step_error(scene, stats.bearing)
    stats.figures |= {"step_error": error, "check_wall_s": time.perf_counter() - started}


def step_error(scene: Scene, bearing: Bearing) -> StepError:
    """Estimated errors of the scene's own step, of a model with the full model's equations.

    With a profile of the speed or load: at its highest. Raises what a run's start raises, see `simulate`.
    """
    steady = _steady(scene)
    return _Piece(steady, bearing, full_run(steady, bearing)).error()


def with_chosen_step(scene: Scene, bearing: Bearing) -> tuple[Scene, StepError]:
    """The scene with the longest step that keeps all errors within tolerance, and these errors; see `step_error`.

    The search begins with the scene's own step, or the longest below the limit of stability, and tries 2, 4 and 8 times
    finer ones. If none is fine enough, it takes the finest, or the first if finer ones gain nothing. If chance hides
    the errors of the step that is found, they are estimated again in a piece `LONGER` times as long, if the run is
    longer, and the longest of 1, 2 and 4 times finer steps is taken that is then known to be fine enough.
    """
    steady, coarser = _steady(scene), level_of(scene.model).coarser

    def stepping(per_output: int) -> Scene:
        return replace(scene, solver=replace(scene.solver, step_s=1 / (scene.output_rate_hz * per_output * coarser)))

    run = full_run(steady, bearing)
    most = MOST_FINER * run.steps_per_output
    limit_s = elastic_limit_s(run.method, run.model, run.state) or math.inf
    start = run.with_finer_steps(min(MOST_FINER, max(1, math.ceil(run.step_s / limit_s))))
    chosen, error = _search(steady, bearing, start, most)
    if error.open and not error.stalled and scene.duration_s > PIECE_S:
        longer = _Piece(steady, bearing, start.with_finer_steps(1), longer=LONGER).error()
        for finer in (1, 2, FINER):
            known = longer.with_steps(finer)
            if start.steps_per_output * finer <= most and not (known.certain or known.open):
                return stepping(start.steps_per_output * finer), known
    return stepping(chosen), error


def _search(scene: Scene, bearing: Bearing, start: FullRun, most: int) -> tuple[int, StepError]:
    """Number of steps per output, at `most` that many, and errors, see `with_chosen_step`."""
    piece = _Piece(scene, bearing, start.with_finer_steps(1))
    steps, first = start.steps_per_output, piece.error()
    second = error = first
    while True:
        for finer in (1, 2, FINER):
            if steps * finer <= most and not error.with_steps(finer).beyond:
                return steps * finer, error.with_steps(finer)
        if steps * FINER > most:
            break
        steps *= FINER
        if error.lost:
            piece = _Piece(scene, bearing, start.with_finer_steps(steps // start.steps_per_output))
        second = piece.error(1 if error.lost else steps // start.steps_per_output)
        error = second.with_coarser(error)
    if second is not first and not second.gains(first):
        return start.steps_per_output, replace(first, stalled=True)
    finest = most // steps
    return steps * finest, error.with_steps(finest)


def _steady(scene: Scene) -> Scene:
    """The scene at the highest speed and load of its profiles."""
    if scene.speed_profile is not None:
        fastest = max(scene.speed_profile.speed_rad_s, key=abs)
        scene = replace(scene, speed_profile=None, shaft_speed_rad_s=fastest)
    if scene.load_profile is not None:
        load = replace(scene.load, radial_n=max(scene.load_profile.radial_n), axial_n=max(scene.load_profile.axial_n))
        scene = replace(scene, load_profile=None, load=load)
    return scene


class _Piece:
    """A short piece of a run from one settled state, with the run's step and with finer ones, each run once.

    Outputs are taken more often if `BLOCKS` need it. Bands are compared if the run's outputs have them, in long pieces.
    """

    def __init__(self, scene: Scene, bearing: Bearing, run: FullRun, *, longer: float = 1.0) -> None:
        passage_s = 1 / bearing.orders.at(scene.shaft_hz).bpfo_hz
        length_s = min(scene.duration_s, longer * max(PIECE_S, min(PASSAGES * passage_s, LONGEST_S)))
        self.run = run = run.with_outputs(2 * BLOCKS / length_s)
        self.rate_hz, self.bands_below_hz = run.output_rate_hz, 0.5 * scene.output_rate_hz * (length_s >= LEAST_S)
        self.settle, self.length = round(scene.settle_s * self.rate_hz), max(2 * BLOCKS, round(length_s * self.rate_hz))
        run.advance(0, self.settle)
        self.known: dict[int, tuple[float, BlockMeans]] = {}

    def error(self, finer: int = 1) -> StepError:
        """Errors of steps `finer` times finer than the run's."""
        for times in (finer, FINER * finer):
            if times not in self.known:
                out = self.run.with_finer_steps(times).advance(self.settle, self.length).out
                out, sums = out[round(SETTLED * self.length) :], RunningSums()
                sums.add(out)
                means = block_means(
                    self.rate_hz,
                    out[:, col.CAGE_SPEED],
                    out[:, col.ACCELERATION],
                    out[:, col.DRIVE_POWER],
                    bands_below_hz=self.bands_below_hz,
                )
                self.known[times] = sums.energy_imbalance(1 / self.rate_hz), means
        (gap, means), (remains, right) = self.known[finer], self.known[FINER * finer]
        step_s = self.run.step_s / finer
        found = StepError(step_s=step_s, estimates=differences(means, right), energy=gap - remains)
        return replace(found.with_steps((FINER - 1) / FINER), step_s=step_s)


def block_means(
    fs_hz: float,
    cage_rad_s: FloatArray,
    acceleration_m_s2: FloatArray,
    drive_w: FloatArray,
    *,
    bands_below_hz: float = math.inf,
) -> BlockMeans:
    """Means of `BLOCKS` equal parts of a run of [n] samples, without bands above half the rate or `bands_below_hz`.

    All bands are left out if an acceleration is not finite.
    """
    found = {CAGE: cage_rad_s, DRIVE_POWER: drive_w}
    along = along_sensor(acceleration_m_s2)
    for name, band_hz in BANDS_HZ.items():
        if band_hz[1] < min(0.5 * fs_hz, bands_below_hz) and np.all(np.isfinite(along)):
            found[f"RMS in {name} Hz"] = band_squares(along, fs_hz, band_hz)
    whole = len(along) // BLOCKS * BLOCKS
    return {name: values[:whole].reshape(BLOCKS, -1).mean(axis=1) for name, values in found.items()}


def differences(first: BlockMeans, second: BlockMeans) -> tuple[Estimate, ...]:
    """Errors of the means of the `first` run against those of the `second`, which need not be as long."""
    with np.errstate(all="ignore"):
        return tuple(_difference(name, first[name], second[name]) for name in first if name in second)


def _difference(of: str, first: FloatArray, second: FloatArray) -> Estimate:
    kind = KINDS.get(of, "band_rms")
    power = 0.5 if kind == "band_rms" else 1.0

    def error(means: FloatArray) -> FloatArray:
        ratio = means[0] / means[1]
        return np.asarray(np.sign(ratio) * np.abs(ratio) ** power - 1)

    def scatter(means: FloatArray) -> float:
        blocks = means.shape[1]
        without = error((means.sum(axis=1, keepdims=True) - means) / (blocks - 1))
        return math.sqrt((blocks - 1) / blocks * float(((without - without.mean()) ** 2).sum()))

    means = np.array([first, second]) + LEAST[kind]
    whole = means.mean(axis=1)
    finite = bool(np.all(np.isfinite(means)))
    if not (finite and np.any(whole)):
        return Estimate(kind=kind, of=of, error=0.0 if finite else math.inf, scatter=0.0)
    blocks = float((np.abs(means).sum(axis=1) ** 2 / (means**2).sum(axis=1)).min())
    if kind == "band_rms" and blocks < LEAST_BLOCKS:
        levels = power * np.log(means[0] / means[1])
        level = float(levels.mean())
        slope = math.expm1(level) / level if level else 1.0  # a secant: of an error many times its tolerance as well
        scatter_of_level = float(levels.std(ddof=1)) / math.sqrt(len(levels))
        return Estimate(kind=kind, of=of, error=math.expm1(level), scatter=slope * scatter_of_level)
    pairs = means.reshape(2, -1, 2).mean(axis=2)
    return Estimate(
        kind=kind, of=of, error=float(error(whole)), scatter=max(scatter(means), scatter(pairs)), blocks=blocks
    )
