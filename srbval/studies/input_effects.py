"""What open inputs, starts and numerics do to every compared quantity of a scene, propagated together.

Inputs are drawn jointly from their ranges (Latin hypercube: McKay, Beckman & Conover 1979, Technometrics 21, 239) and
the converged model is run at each draw, as long as the runs that are compared. An emulator through these runs gives
the distribution of all quantities together and each input's own share of the variance (first order: Saltelli et al.
2010, Comput. Phys. Commun. 181, 259); what it leaves over, starts among it, is added from what it misses of runs that
it never saw.
The cheaper models know neither slip nor rattle, so there is nothing in them to be corrected: what is cheap
is the run itself.
"""

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from srbval.arrays import FloatArray, IntArray
from srbval.bearing import DEFECTS, load_bearing
from srbval.comparison.budget import STUDY
from srbval.comparison.compared_quantities import COMPARED
from srbval.comparison.counterpart import (
    DETAIL_HZ,
    TURNS,
    AnalysedRun,
    SimulationCase,
    analyse_run,
    converged,
    load_ensemble,
    with_points,
)
from srbval.comparison.effects import DefectEffects, QuantityEffects, Sensitivity
from srbval.comparison.spectrum_shape import halves_of
from srbval.comparison.speed_and_slip import published_speeds
from srbval.errors import ConfigurationError, NumericsError, SrbvalError
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene
from srbval.signal import NORMAL_95
from srbval.studies.emulator import Emulator, fit_emulator
from srbval.studies.open_inputs import OpenInput, drawn, open_inputs

UNITS = {row.name_of(fault): row.unit for fault in DEFECTS for row in COMPARED if row.margin is not None}
NOMINAL_RPM = 877.0  # the rig's speed that recordings of both faults are open for
Values = Mapping[str, float]  # of the compared quantities, by name


def measure(
    *,
    scene: Scene | None = None,
    inputs: Path | None = None,
    draws: int = STUDY.draws,
    turns: float = TURNS,
    progress: Progress = silent,
) -> Sensitivity:
    """Of the paper's scene with every defect at the rig's speed, or of `scene` with its own, at its own length.

    `inputs` names a file of ranges. Raises `ConfigurationError` for a scene without a defect, which shows no line, and
    `NumericsError` where the scene itself cannot be run, or too few of its draws.
    """
    if scene is not None and scene.defect.kind not in DEFECTS:
        raise ConfigurationError("a healthy bearing has no fault line to compare: give the scene a defect.")
    listed = open_inputs(inputs)
    scenes = [scene] if scene is not None else list(paper_scenes(turns))
    return Sensitivity(defects=tuple(_defect_effects(one, listed, draws, progress) for one in scenes))


def paper_scenes(turns: float) -> Iterator[Scene]:
    """The paper's scene with every defect, at its record's mean speed at `NOMINAL_RPM`, `turns` of the shaft long."""
    speeds = {m.state: m.mean_rpm for m in published_speeds().means if m.nominal_rpm == NOMINAL_RPM}
    for state in DEFECTS:
        yield paper_scene(
            duration_s=60 * turns / speeds[state], shaft_speed_rad_s=2 * math.pi * speeds[state] / 60,
            defect={"kind": state}, detail_rate_hz=DETAIL_HZ.get(state, 0.0),
        )  # fmt: skip


def _defect_effects(own: Scene, inputs: Sequence[OpenInput], count: int, progress: Progress) -> DefectEffects:
    state, base = own.defect.kind, converged(own)
    first, *others = [run_unchecked(one) for one in load_ensemble(base)]
    begun = [values_of(run) for run in (first, *others)]
    paper = [values_of(run_unchecked(one)) for one in load_ensemble(own)] if base is not own else []
    points = base.contact.points_per_circle
    grids = [with_points(base, n) for n in (points // 2, 2 * points)] if base.model == "full" else []
    coarse_fine = [values_of(run_unchecked(one)) for one in grids]
    half_step = values_of(run_unchecked(replace(base, solver=replace(base.solver, step_s=base.solver.step_s / 2))))
    shares, runs, rounds = np.empty((0, len(inputs))), list[AnalysedRun](), 0
    fitted: dict[str, Emulator] = {}
    while not rounds or (rounds < STUDY.rounds and not all(_follows(one) for one in fitted.values())):
        more = _draw(base, inputs, count, STUDY.seed + rounds, progress)
        shares, runs, rounds = np.concatenate([shares, more[0]]), [*runs, *more[1]], rounds + 1
        fitted = _emulators(inputs, shares, runs, begun)
    at = coordinates(inputs, _hypercube(inputs, STUDY.predicted))
    means, predicted = predict(inputs, shares, fitted, at)
    effects = []
    for (name, emulator), mean, all_of_it in zip(fitted.items(), means, predicted, strict=True):
        values = [run[name] for run in begun]
        value = statistics.fmean(values)
        grid = grid_ci95(value, *(run.get(name, value) for run in coarse_fine)) if coarse_fine else 0.0
        effects.append(
            QuantityEffects(
                name=name, unit=UNITS[name], value=value,
                shift=float(all_of_it.mean()) - value, deviation=float(all_of_it.std()),
                shares={i.name: _share(x, mean) / float(all_of_it.var()) for i, x in zip(inputs, at.T, strict=True)},
                grid_ci95=math.hypot(grid, 4 / 3 * (half_step.get(name, value) - value)),
                **_paper_points(values, [run[name] for run in paper if name in run]),
                start_sd=statistics.stdev(values), outside=emulator.outside,
            )
        )  # fmt: skip
    spectra = [halves_of(run.analysis, state) for run in (first, *runs)]
    return DefectEffects(
        defect=state.value,
        quantities=tuple(effects),
        draws=len(runs),
        failed=count * rounds - len(runs),
        refined=rounds > 1,
        at=shares.round(5).tolist(),
        values=[[run.values[name].value if name in run.values else None for name in fitted] for run in runs],
        predicted=[[float(f"{x:.6g}") for x in row] for row in predicted.T.tolist()],
        spectrum=None if spectra[0] is None else spectra[0].round(2).tolist(),
        spectra=[one.round(2).tolist() for one in spectra[1:] if one is not None],
    )


def run_unchecked(scene: Scene, band_hz: tuple[float, float] | None = None) -> AnalysedRun:
    """A run and its analysis; `NumericsError` where it failed. Its step is not checked."""
    run = simulate(scene, step=Step.UNCHECKED)  # what the step does is part of the study
    case = SimulationCase(id="sensitivity", purpose="sensitivity", state=scene.defect.kind, scene=scene)
    return analyse_run(case, run.require_usable("sensitivity: a run"), load_bearing(scene.bearing), band_hz)


def values_of(run: AnalysedRun) -> Values:
    """The compared quantities of a run."""
    return {name: value.value for name, value in run.values.items() if name in UNITS}


def _hypercube(inputs: Sequence[OpenInput], count: int, seed: int = STUDY.seed) -> FloatArray:
    from scipy.stats import qmc

    return np.asarray(qmc.LatinHypercube(d=len(inputs), rng=np.random.default_rng(seed)).random(count))


def _draw(
    base: Scene, inputs: Sequence[OpenInput], count: int, seed: int, progress: Progress
) -> tuple[FloatArray, list[AnalysedRun]]:
    """Coordinates, [runs, inputs], and runs at draws of all inputs; those that fail are left out."""
    shares, runs, what = [], [], f"Simulate open inputs, {base.defect.kind}"
    for number, row in enumerate(_hypercube(inputs, count, seed).tolist()):
        progress(what, number / count)
        scene, band_hz = drawn(inputs, base, row)
        try:
            runs.append(run_unchecked(scene, band_hz))
        except SrbvalError:
            continue
        shares.append([one.coordinate(share) for one, share in zip(inputs, row, strict=True)])
    progress(what, 1.0)
    if len(runs) < STUDY.least_draws:
        raise NumericsError(f"sensitivity: {len(runs)} of {count} draws could be run, {STUDY.least_draws} are needed.")
    return np.array(shares), runs


def _emulators(
    inputs: Sequence[OpenInput], shares: FloatArray, runs: Sequence[AnalysedRun], begun: Sequence[Values]
) -> dict[str, Emulator]:
    """One for every quantity that all starts and nearly all draws show."""
    found, groups = {}, groups_of(inputs, shares)
    for name in UNITS:
        rows = [i for i, run in enumerate(runs) if name in run.values]
        if len(rows) >= STUDY.least_read * len(runs) and all(name in one for one in begun):
            values = np.array([runs[i].values[name].value for i in rows])
            found[name] = fit_emulator(shares[rows], values, groups[rows])
    return found


def _follows(emulator: Emulator) -> bool:
    """Whether an emulator misses few enough of its runs, and leaves little enough of them over."""
    missed = math.sqrt(float(np.mean(emulator.residuals**2)))
    return emulator.outside <= STUDY.most_outside and missed <= STUDY.most_left_over * emulator.scale


def groups_of(inputs: Sequence[OpenInput], at: FloatArray) -> IntArray:
    """Which combination of all choices each of the points `at`, [n, inputs], has: 0 to below their number."""
    chosen = [place for place, one in enumerate(inputs) if one.choices]
    return np.asarray(np.unique(at[:, chosen], axis=0, return_inverse=True)[1]).ravel()


def predict(
    inputs: Sequence[OpenInput], shares: FloatArray, fitted: Mapping[str, Emulator], at: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The emulators at draws of the inputs, [draws, inputs], and these with what they leave over [quantities, draws].

    `shares` are the runs' inputs, [runs, inputs]. Left over is what they miss of one run that they never saw, with the
    same choices, all quantities' together; 0 where it lacks one.
    """
    rng = np.random.default_rng(STUDY.seed)
    means = np.array([one(at) for one in fitted.values()])
    runs = {tuple(row): place for place, row in enumerate(shares.tolist())}
    residuals = np.zeros((len(fitted), len(shares)))
    for own, one in zip(residuals, fitted.values(), strict=True):
        own[[runs[tuple(row)] for row in one.points.tolist()]] = one.residuals
    groups = groups_of(inputs, np.concatenate([shares, at]))
    runs_of = [np.flatnonzero(groups[: len(shares)] == group) for group in groups[len(shares) :]]
    picked = [rng.choice(own if own.size else len(shares)) for own in runs_of]
    return means, means + residuals[:, picked]


def coordinates(inputs: Sequence[OpenInput], shares: FloatArray) -> FloatArray:
    """Where shares of the probability, [draws, inputs], lie between the inputs' ends."""
    return np.array([[i.coordinate(share) for i, share in zip(inputs, row, strict=True)] for row in shares.tolist()])


def _share(coordinate: FloatArray, mean: FloatArray) -> float:
    """Variance of the mean of `mean` given one input's coordinate, by bins of it."""
    place = np.minimum((coordinate * STUDY.bins).astype(int), STUDY.bins - 1)
    count = np.bincount(place, minlength=STUDY.bins)
    filled = count > 0
    by_bin = np.bincount(place, weights=mean, minlength=STUDY.bins)[filled] / count[filled]
    return float(np.average((by_bin - mean.mean()) ** 2, weights=count[filled]))


def grid_ci95(middle: float, coarse: float, fine: float) -> float:
    """Grid-convergence index of the middle one of three grids, each twice as fine as the one before.

    Roache 1994 (J. Fluids Eng. 116, 405), for the middle grid: 1.25 |fine - middle| 2^p / (2^p - 1), the observed order
    p held between 0.5 and 2 (the lower one where the values do not converge from one side).
    """
    first, second = middle - coarse, fine - middle
    least, most = STUDY.grid_least_order, STUDY.grid_most_order
    order = math.log2(first / second) if second and first / second > 0 else least
    power = 2 ** min(max(order, least), most)
    return STUDY.grid_safety * abs(second) * power / (power - 1)


def _paper_points(converged_values: Sequence[float], own: Sequence[float]) -> dict[str, float | None]:
    """What the scene's own number of points does, and its scatter over starts; nothing where it is converged."""
    if len(own) < 2:
        return {"paper_points": None, "paper_points_ci95": None, "paper_start_sd": None}
    u = math.hypot(*(statistics.stdev(one) / math.sqrt(len(one)) for one in (own, converged_values)))
    return {
        "paper_points": statistics.fmean(own) - statistics.fmean(converged_values),
        "paper_points_ci95": NORMAL_95 * u,
        "paper_start_sd": statistics.stdev(own),
    }
