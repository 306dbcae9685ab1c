"""Estimates the errors of a run's results due to its step, and chooses a step that keeps them within tolerance.

The method is described on the page "Time integration" of the theory, "The error that a step leaves". Its sources: the
delete-one-block jackknife of Efron & Tibshirani, An Introduction to the Bootstrap, 1993, chapter 11, and Kish's
effective sample size, Survey Sampling, 1965, section 8.2, both quoted from memory and not checked.
"""

import math
import time
from dataclasses import replace

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Bearing
from srbval.models import outputs as col
from srbval.models.estimates import BLOCKS, REFINEMENT, Estimate, StepError
from srbval.models.full_run import FullRun, start_full_run
from srbval.models.hierarchy import level_of
from srbval.models.run_statistics import RunningSums, RunStatistics
from srbval.models.sensor import along_sensor, band_squares
from srbval.models.step_limits import elastic_limit_s
from srbval.scene import BANDS_HZ, Scene

BlockMeans = dict[str, FloatArray]  # by quantity: means over blocks, [BLOCKS]; for bands, of squares
CAGE_QUANTITY, DRIVE_QUANTITY = "mean cage speed", "drive power"  # names of quantities; the RMS of each band is another
QUANTITY_KINDS = {CAGE_QUANTITY: "cage", DRIVE_QUANTITY: "drive_power"}  # other quantities are "band_rms"
# Negligible values, added to the means before they are compared (for bands: squares). The noise of industrial
# accelerometers in such a band is 1e-4 m/s2 or more; without contact the rounding is 1e-11 m/s2.
NEGLIGIBLE_MEANS = {"cage": 0.0, "band_rms": 1e-4**2, "drive_power": 1e-3}  # -, (m/s2)^2, W
MIN_BLOCKS_FOR_SPREAD = 4  # if fewer blocks contain a band's power (single knocks), their geometric means are compared
MAX_REFINEMENT = 8  # most steps in place of one of the scene's; limits the cost of a chosen step
PIECE_S = 0.15  # both runs cost five times this: 8 % of a ten-second run, 10 % if a quarter of the step is chosen
LONG_PIECE_FACTOR = 4.0  # on `PIECE_S` if chance hides the errors of a step to be chosen: a third of a ten-second run
MIN_PASSAGES = 4.0  # least number of roller passages over a point of the outer race in a piece
MAX_PIECE_S = 1.0  # longest piece; at slow shafts it contains fewer passages
SETTLING_SHARE = 0.25  # share of a piece that is left out while the motion settles to the finer step
MIN_BAND_PIECE_S = 0.02  # shortest piece whose bands are compared


def check_step(stats: RunStatistics, *, choose: bool) -> None:
    """Estimate the error due to the step, or `choose` a step; store the estimate and its wall time in `stats`."""
    scene, started = stats.scene, time.perf_counter()
    start_full_run(scene, stats.bearing).advance(0, 0)
    stats.compile_s, started = stats.compile_s + time.perf_counter() - started, time.perf_counter()
    with np.errstate(all="ignore"):
        if choose:
            stats.scene, error = with_chosen_step(scene, stats.bearing)
        else:
            error = step_error(scene, stats.bearing)
    stats.figures |= {"step_error": error, "check_wall_s": time.perf_counter() - started}


def step_error(scene: Scene, bearing: Bearing) -> StepError:
    """Estimate the errors due to the scene's step, for a model with the full model's equations.

    If speed or load varies, the errors are those at the highest speed and load. Raises the exceptions of `simulate`.
    """
    steady = _steady(scene)
    return _Piece(steady, bearing, start_full_run(steady, bearing)).error()


def with_chosen_step(scene: Scene, bearing: Bearing) -> tuple[Scene, StepError]:
    """Choose the longest step that keeps all errors within tolerance; returns the scene with this step, and the errors.

    Errors are estimated from a short simulation. The search begins with the scene's step, made shorter if it is
    unstable, and tries steps up to `MAX_REFINEMENT` times finer. If none is fine enough, the finest is chosen, or the
    search's first step if finer ones do not reduce the errors. If scatter hides whether the chosen step is fine
    enough, and the run is longer than `PIECE_S`, the errors are estimated again from a simulation `LONG_PIECE_FACTOR`
    times as long; the longest step that is then certainly fine enough, if any, is chosen instead.
    """
    steady = _steady(scene)
    run = start_full_run(steady, bearing)
    most = MAX_REFINEMENT * run.steps_per_output
    limit_s = elastic_limit_s(run.method, run.model, run.state) or math.inf
    start = run.with_finer_steps(min(MAX_REFINEMENT, max(1, math.ceil(run.step_s / limit_s))))
    chosen, error = _search(steady, bearing, start, most)
    if error.undecided_estimates and not error.stalled and scene.duration_s > PIECE_S:
        longer = _Piece(steady, bearing, start.with_finer_steps(1), longer=LONG_PIECE_FACTOR).error()
        for finer in (1, 2, REFINEMENT):
            known = longer.extrapolated_to(finer)
            if start.steps_per_output * finer <= most and not (known.certain_excesses or known.undecided_estimates):
                chosen, error = start.steps_per_output * finer, known
                break
    step_s = 1 / (scene.output_rate_hz * chosen * level_of(scene.model).coarser)
    return replace(scene, solver=replace(scene.solver, step_s=step_s)), error


def _search(scene: Scene, bearing: Bearing, start: FullRun, most: int) -> tuple[int, StepError]:
    """Choose a number of solver steps per output interval, from that of `start` to `most`; also returns the errors."""
    piece = _Piece(scene, bearing, start.with_finer_steps(1))
    steps, first = start.steps_per_output, piece.error()
    error = first
    while True:
        for finer in (1, 2, REFINEMENT):
            if steps * finer <= most and not error.extrapolated_to(finer).needs_finer_steps:
                return steps * finer, error.extrapolated_to(finer)
        if steps * REFINEMENT > most:
            break
        steps *= REFINEMENT
        finer = steps // start.steps_per_output
        if not all(abs(estimate.error) < 1 for estimate in error.estimates):  # the piece's first state is useless
            piece, finer = _Piece(scene, bearing, start.with_finer_steps(finer)), 1
        error = piece.error(finer)
    if error is not first and not error.improves_on(first):
        return start.steps_per_output, replace(first, stalled=True)
    finest = most // steps
    return steps * finest, error.extrapolated_to(finest)


def _steady(scene: Scene) -> Scene:
    """Replace the scene's profiles of speed and load by their highest values."""
    speed_rad_s, (_, radial_n, axial_n) = scene.speed_table()[1], scene.load_table()
    load = replace(scene.load, radial_n=float(radial_n.max()), axial_n=float(axial_n.max()))
    fastest = float(speed_rad_s.max())
    return replace(scene, speed_profile=None, load_profile=None, shaft_speed_rad_s=fastest, load=load)


class _Piece:
    """Short piece of a run, simulated with different steps to estimate their errors, each time from the same state.

    This is the state of `run` after the scene's settling time. The piece lasts `longer` times as long as usual. Results
    are averaged over each of `BLOCKS` equal blocks of the piece; the output rate is raised if a block would contain
    fewer than two. RMS is compared in frequency bands below half the scene's output rate, if the piece is long enough.
    """

    def __init__(self, scene: Scene, bearing: Bearing, run: FullRun, *, longer: float = 1.0) -> None:
        passage_s = 1 / bearing.orders.at(scene.shaft_hz).bpfo_hz
        length_s = min(scene.duration_s, longer * max(PIECE_S, min(MIN_PASSAGES * passage_s, MAX_PIECE_S)))
        self.run = run = run.with_output_rate(2 * BLOCKS / length_s)
        self.rate_hz = run.output_rate_hz
        self.bands_below_hz = 0.5 * scene.output_rate_hz * (length_s >= MIN_BAND_PIECE_S)
        self.settle, self.length = round(scene.settle_s * self.rate_hz), max(2 * BLOCKS, round(length_s * self.rate_hz))
        run.advance(0, self.settle)
        self.known: dict[int, tuple[float, BlockMeans]] = {}

    def error(self, finer: int = 1) -> StepError:
        """Estimate errors with the run's step / `finer`, by comparison with a step again `REFINEMENT` times shorter."""
        for times in (finer, REFINEMENT * finer):
            if times not in self.known:
                out = self.run.with_finer_steps(times).advance(self.settle, self.length).out
                out, sums = out[round(SETTLING_SHARE * self.length) :], RunningSums()
                sums.add(out)
                means = block_means(self.rate_hz, out, bands_below_hz=self.bands_below_hz)
                self.known[times] = sums.energy_imbalance(1 / self.rate_hz), means
        (gap, means), (remains, right) = self.known[finer], self.known[REFINEMENT * finer]
        step_s = self.run.step_s / finer
        found = StepError(step_s=step_s, estimates=estimate_errors(means, right), energy=gap - remains)
        return replace(found.extrapolated_to((REFINEMENT - 1) / REFINEMENT), step_s=step_s)


def block_means(fs_hz: float, out: FloatArray, *, bands_below_hz: float = math.inf) -> BlockMeans:
    """Means of each quantity over `BLOCKS` equal blocks of a run, from its outputs, [n, COLUMN_COUNT].

    For a frequency band, the squared acceleration is averaged. Bands that reach `bands_below_hz` or half of `fs_hz`,
    the output rate, are left out, and all bands if an acceleration is not finite.
    """
    found = {CAGE_QUANTITY: out[:, col.CAGE_SPEED], DRIVE_QUANTITY: out[:, col.MEAN_DRIVE_POWER]}
    along = along_sensor(out[:, col.ACCELERATION_XYZ])
    for name, band_hz in BANDS_HZ.items():
        if band_hz[1] < min(0.5 * fs_hz, bands_below_hz) and np.all(np.isfinite(along)):
            found[f"RMS in {name} Hz"] = band_squares(along, fs_hz, band_hz)
    whole = len(along) // BLOCKS * BLOCKS
    return {name: values[:whole].reshape(BLOCKS, -1).mean(axis=1) for name, values in found.items()}


def estimate_errors(first: BlockMeans, second: BlockMeans) -> tuple[Estimate, ...]:
    """Relative errors of the means of a run (`first`) against those of a more accurate run, with standard errors."""
    with np.errstate(all="ignore"):
        return tuple(_estimate_error(name, first[name], second[name]) for name in first if name in second)


def _estimate_error(of: str, first: FloatArray, second: FloatArray) -> Estimate:
    kind = QUANTITY_KINDS.get(of, "band_rms")
    power = 0.5 if kind == "band_rms" else 1.0

    def error(means: FloatArray) -> FloatArray:
        ratio = means[0] / means[1]
        return np.asarray(np.sign(ratio) * np.abs(ratio) ** power - 1)

    def scatter(means: FloatArray) -> float:
        blocks = means.shape[1]
        without = error((means.sum(axis=1, keepdims=True) - means) / (blocks - 1))
        return math.sqrt((blocks - 1) / blocks * float(((without - without.mean()) ** 2).sum()))

    means = np.array([first, second]) + NEGLIGIBLE_MEANS[kind]
    whole = means.mean(axis=1)
    finite = bool(np.all(np.isfinite(means)))
    if not (finite and np.any(whole)):
        return Estimate(kind=kind, of=of, error=0.0 if finite else math.inf, scatter=0.0)
    blocks = float((np.abs(means).sum(axis=1) ** 2 / (means**2).sum(axis=1)).min())
    if kind == "band_rms" and blocks < MIN_BLOCKS_FOR_SPREAD:
        levels = power * np.log(means[0] / means[1])
        level = float(levels.mean())
        slope = math.expm1(level) / level if level else 1.0  # a secant, which also holds for large errors
        scatter_of_level = float(levels.std(ddof=1)) / math.sqrt(len(levels))
        return Estimate(kind=kind, of=of, error=math.expm1(level), scatter=slope * scatter_of_level)
    pairs = means.reshape(2, -1, 2).mean(axis=2)
    larger = max(scatter(means), scatter(pairs))
    return Estimate(kind=kind, of=of, error=float(error(whole)), scatter=larger, blocks=blocks)
