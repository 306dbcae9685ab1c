"""What open inputs, starts and numerics do to every compared quantity of a scene, propagated together.

Inputs are drawn jointly from their ranges (Latin hypercube: McKay, Beckman & Conover 1979, Technometrics 21, 239) and
the converged model is run at each draw, as long as the runs that are compared. An emulator through these runs gives
mean, covariance and each input's own share of the variance (first order: Saltelli et al. 2010, Comput. Phys. Commun.
181, 259); what it leaves over, starts among it, is added from its leave-one-out residuals. The cheaper rungs of the
ladder know neither slip nor rattle, so there is nothing in them to be corrected: what is cheap is the run itself.
"""

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, load_bearing
from srbval.errors import ConfigurationError, NumericsError, SrbvalError
from srbval.models.simulate import Step, simulate
from srbval.progress import Progress, silent
from srbval.scene import Scene, paper_scene
from srbval.signal import NORMAL_95
from srbval.validation.compared_quantities import COMPARED, own_effects
from srbval.validation.counterpart import DETAIL_HZ, TURNS, AnalysedRun, analyse_run, converged, starts, with_points
from srbval.validation.effects import DefectEffects, QuantityEffects, Sensitivity
from srbval.validation.emulator import Emulator, fit_emulator
from srbval.validation.open_inputs import OpenInput, drawn, open_inputs
from srbval.validation.simulation_cases import SimulationCase
from srbval.validation.spectrum_shape import halves_of
from srbval.validation.speed_and_slip import published_speeds

UNITS = {row.name_of(fault): row.unit for fault in DEFECTS for row in COMPARED if row.effects is own_effects}
NOMINAL_RPM = 877.0  # the rig's speed that recordings of both faults are open for
DRAWS, LEAST_DRAWS, SEED = 60, 12, 1
SPECTRA = 12  # of the draws, kept for the shape of the spectrum
LEAST_READ = 0.8  # of the runs, for a quantity to be taken in
MOST_OUTSIDE = 0.08  # of all runs' quantities, by the emulators; else as many runs again are drawn
PREDICTED, BINS = 4096, 16  # draws that the emulator answers; of an input's range, for its share
SAFETY, ORDER = 1.25, (0.5, 2.0)  # of the grid-convergence index

Values = Mapping[str, float]  # of the compared quantities, by name


def measure(
    *,
    scene: Scene | None = None,
    inputs: Path | None = None,
    draws: int = DRAWS,
    turns: float = TURNS,
    progress: Progress = silent,
) -> Sensitivity:
    """Of the paper's scene with every defect at the rig's speed, or of `scene` with its own, at its own length.

    `inputs` names a file of ranges. Raises `ConfigurationError` for a scene without a defect, which shows no line, and
    `NumericsError` where the scene itself cannot be run, or fewer than `LEAST_DRAWS` of its draws.
    """
    if scene is not None and scene.defect.kind not in DEFECTS:
        raise ConfigurationError("a healthy bearing has no fault line to compare: give the scene a defect.")
    listed = open_inputs(inputs)
    scenes = [scene] if scene is not None else list(_paper_scenes(turns))
    return Sensitivity(defects=tuple(_defect_effects(one, listed, draws, progress) for one in scenes))


def _paper_scenes(turns: float) -> Iterator[Scene]:
    speeds = {m.state: m.mean_rpm for m in published_speeds().means if m.nominal_rpm == NOMINAL_RPM}
    for state in DEFECTS:
        yield paper_scene(
            duration_s=60 * turns / speeds[state], shaft_speed_rad_s=2 * math.pi * speeds[state] / 60,
            defect={"kind": state}, detail_rate_hz=DETAIL_HZ.get(state, 0.0),
        )  # fmt: skip


def _defect_effects(own: Scene, inputs: Sequence[OpenInput], count: int, progress: Progress) -> DefectEffects:
    state, base = own.defect.kind, converged(own)
    begun = [_values(_run(one)) for one in starts(base)]
    paper = [_values(_run(one)) for one in starts(own)] if base is not own else []
    points = base.contact.points_per_circle
    grids = [with_points(base, n) for n in (points // 2, 2 * points)] if base.model == "full" else []
    coarse_fine = [_values(_run(one)) for one in grids]
    half_step = _values(_run(replace(base, solver=replace(base.solver, step_s=base.solver.step_s / 2))))
    shares, runs = _draw(base, inputs, count, SEED, progress)
    fitted = _emulators(shares, runs, begun)
    if refined := statistics.fmean(one.outside for one in fitted.values()) > MOST_OUTSIDE:
        more = _draw(base, inputs, count, SEED + 1, progress)
        shares, runs = np.concatenate([shares, more[0]]), [*runs, *more[1]]
        fitted = _emulators(shares, runs, begun)
    at = np.array(
        [[i.coordinate(s) for i, s in zip(inputs, row, strict=True)] for row in _hypercube(inputs, PREDICTED)]
    )
    means = np.array([one(at) for one in fitted.values()])
    covariance = np.cov(means) + _left_over(fitted, shares)
    deviation = np.sqrt(np.diag(covariance))
    effects = []
    for name, mean, total, emulator in zip(fitted, means, (deviation**2).tolist(), fitted.values(), strict=True):
        values = [run[name] for run in begun]
        value = statistics.fmean(values)
        grid = grid_ci95(value, *(run.get(name, value) for run in coarse_fine)) if coarse_fine else 0.0
        effects.append(
            QuantityEffects(
                name=name, unit=UNITS[name], value=value, shift=float(mean.mean()) - value, deviation=math.sqrt(total),
                shares={one.name: _share(column, mean) / total for one, column in zip(inputs, at.T, strict=True)},
                grid_ci95=math.hypot(grid, 4 / 3 * (half_step.get(name, value) - value)),
                **_paper_points(values, [run[name] for run in paper if name in run]),
                start_sd=statistics.stdev(values), outside=emulator.outside,
            )
        )  # fmt: skip
    spectra = [halves_of(run.analysis, state) for run in runs[:SPECTRA]]
    return DefectEffects(
        defect=state.value,
        quantities=tuple(effects),
        correlation=(covariance / np.outer(deviation, deviation)).round(4).tolist(),
        draws=len(runs),
        failed=count * (1 + refined) - len(runs),
        refined=refined,
        at=shares.round(5).tolist(),
        values=[[run.values[name].value if name in run.values else None for name in fitted] for run in runs],
        spectra=[one.round(3).tolist() for one in spectra if one is not None],
    )


def _run(scene: Scene, band_hz: tuple[float, float] | None = None) -> AnalysedRun:
    run = simulate(scene, step=Step.UNCHECKED)  # what the step does is part of the study
    if not run.status.usable:
        raise NumericsError(f"sensitivity: a run failed ({run.status}): {run.reason}.")
    case = SimulationCase(id="sensitivity", purpose="sensitivity", state=scene.defect.kind, scene=scene)
    return analyse_run(case, run, load_bearing(scene.bearing), band_hz)


def _values(run: AnalysedRun) -> Values:
    return {name: value.value for name, value in run.values.items() if name in UNITS}


def _hypercube(inputs: Sequence[OpenInput], count: int, seed: int = SEED) -> FloatArray:
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
            runs.append(_run(scene, band_hz))
        except SrbvalError:
            continue
        shares.append([one.coordinate(share) for one, share in zip(inputs, row, strict=True)])
    progress(what, 1.0)
    if len(runs) < LEAST_DRAWS:
        raise NumericsError(f"sensitivity: {len(runs)} of {count} draws could be run, {LEAST_DRAWS} are needed.")
    return np.array(shares), runs


def _emulators(shares: FloatArray, runs: Sequence[AnalysedRun], begun: Sequence[Values]) -> dict[str, Emulator]:
    """One for every quantity that all starts and nearly all draws show."""
    found = {}
    for name in UNITS:
        rows = [i for i, run in enumerate(runs) if name in run.values]
        if len(rows) >= LEAST_READ * len(runs) and all(name in one for one in begun):
            found[name] = fit_emulator(shares[rows], np.array([runs[i].values[name].value for i in rows]))
    return found


def _left_over(fitted: Mapping[str, Emulator], shares: FloatArray) -> FloatArray:
    """Covariance of the emulators' leave-one-out residuals, runs that lack a quantity counted as uncorrelated."""
    runs = {tuple(row): place for place, row in enumerate(shares.tolist())}
    residuals = np.zeros((len(fitted), len(shares)))
    for own, one in zip(residuals, fitted.values(), strict=True):
        own[[runs[tuple(row)] for row in one.points.tolist()]] = one.residuals
    covariance = residuals @ residuals.T / len(shares)
    np.fill_diagonal(covariance, [np.mean(one.residuals**2) for one in fitted.values()])
    return covariance


def _share(coordinate: FloatArray, mean: FloatArray) -> float:
    """Variance of the mean of `mean` given one input's coordinate, by bins of it."""
    place = np.minimum((coordinate * BINS).astype(int), BINS - 1)
    count = np.bincount(place, minlength=BINS)
    filled = count > 0
    by_bin = np.bincount(place, weights=mean, minlength=BINS)[filled] / count[filled]
    return float(np.average((by_bin - mean.mean()) ** 2, weights=count[filled]))


def grid_ci95(middle: float, coarse: float, fine: float) -> float:
    """Grid-convergence index of the middle one of three grids, each twice as fine as the one before.

    Roache 1994 (J. Fluids Eng. 116, 405), for the middle grid: 1.25 |fine - middle| 2^p / (2^p - 1), the observed order
    p held between 0.5 and 2 (the lower one where the values do not converge from one side).
    """
    first, second = middle - coarse, fine - middle
    order = math.log2(first / second) if second and first / second > 0 else ORDER[0]
    power = 2 ** min(max(order, ORDER[0]), ORDER[1])
    return SAFETY * abs(second) * power / (power - 1)


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
