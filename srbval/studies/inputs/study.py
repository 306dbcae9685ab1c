"""Uncertain inputs of the scenes `paper` and `rig`, drawn together: effects on every quantity, draws of the cage ratio.

One set of draws of all inputs of a scene serves all records, so that the difference between two records has the spread
of the difference, in which shared inputs cancel. ASME V&V 20 calls the spread u_input. Each input is also varied alone,
all others nominal. The verdicts on the cage ratio (`srbval.comparison.verdicts`) use the draws at every record's speed;
the uncertainty of every compared quantity uses the draws at `NOMINAL_RPM`, each run as long as the runs compared. These
runs are converged and do not depend on their start.

Simulated rigs then give the power of the verdicts. A rig has the registered records with the uncertainties of their
readings and speeds. Its true ratios are those of the scene `rig` at one draw, unknown to the verdict, times a planted
error of one endpoint. The records' samples and their analysis are not simulated.
"""

import math
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, DEFECTS, RACE_DEFECTS, Fault, load_bearing
from srbval.comparison.budget import STUDY
from srbval.comparison.cage_means import cage_means, covariance
from srbval.comparison.cage_readings import CageReading, cage_readings
from srbval.comparison.compared_quantities import COMPARED
from srbval.comparison.counterpart import DETAIL_HZ, TURNS, SimulationCase, analyse_run, converged, with_points
from srbval.comparison.open_inputs import BAND, Drawn, drawn, open_inputs
from srbval.comparison.speed_and_slip import published_speeds
from srbval.comparison.verdicts import endpoints, of_model, verdict
from srbval.comparison.vocabulary import Verdict
from srbval.errors import NumericsError
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings.registry import load_entry, rig_recordings
from srbval.scene import Scene, changes_at, load_scene, merge, paper_scene, rig_inputs, sobol
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.sweep import Case, Measures, sweep

if TYPE_CHECKING:
    import pandas as pd

Row = dict[str, Any]
Shares = Sequence[float | None]  # of the ranges of a scene's inputs; None is an input's nominal value
CAGE_STATES = (Fault.HEALTHY, *RACE_DEFECTS)
CAGE_TURNS = 3.0  # of the shaft: the cage ratio differs from that of thirty turns by less than 1e-5 of it
# Twelve roller passages: the cage ratio differs from that of two seconds by less than 1e-6 of it. The scene's own step
# exceeds the stiffest roller's limit where contacts are longest.
RIG_RUN = {"settle_s": 0.05, "duration_s": 0.1, "solver": {"step_s": 1 / 61_440}}
FINE_SLICES = 61
NOMINAL_RPM = 877.0  # the rig's speed with open recordings of all faults
QUICK_POWER, QUICK_RIGS = 3, 20
BINS = 4  # of an input's range, for its share of the variance
PLANTED_PCT, SEED = (0.0, 0.05, 0.1, 0.2), 36


def records(states: Sequence[Fault] = CAGE_STATES) -> list[Row]:
    """State and mean speed of the rig's published records of `states`.

    For the cage, a record with a roller's fault has the healthy bearing's runs: such a defect lowers the cage ratio of
    the paper's scene by 2e-5 of it (0.431498 for 0.431507 at 353 rpm).
    """
    return [
        {"state": mean.state.value, "nominal_rpm": mean.nominal_rpm, "shaft_rpm": mean.mean_rpm}
        for mean in published_speeds().means
        if mean.state in states
    ]


def paper_at(record: Case, shares: Shares, turns: float = CAGE_TURNS) -> Drawn:
    """The paper's scene at a record's speed and `shares` of its first inputs, and the envelope's band."""
    rpm, state = record["shaft_rpm"], Fault(record["state"])
    scene = paper_scene(
        shaft_speed_rad_s=2 * math.pi * rpm / 60,
        duration_s=60 * turns / rpm,
        defect={"kind": state},
        detail_rate_hz=DETAIL_HZ.get(state, 0.0) if turns > CAGE_TURNS else 0.0,
    )
    return drawn(open_inputs()[: len(shares)], converged(scene), shares)


def rig_at(record: Case, shares: Shares) -> Drawn:
    """The scene `rig` at a record's speed and `shares` of its inputs."""
    listed = rig_inputs()
    own = {"defect": {"kind": record["state"]}, "shaft_speed": f"{record['shaft_rpm']} rpm"}
    at = [one.nominal_share if share is None else share for one, share in zip(listed, shares, strict=True)]
    return load_scene("rig", merge(merge(own, RIG_RUN), changes_at(listed, at))), SIMULATED_BAND_HZ


def finer(scene: Scene) -> Scene:
    """Half the step, and twice the points on a circle or more slices along a roller."""
    halved = replace(scene, solver=replace(scene.solver, step_s=scene.solver.step_s / 2))
    if scene.model == "slices":
        return replace(halved, line_contact=replace(scene.line_contact, slices=FINE_SLICES))
    return with_points(halved, 2 * scene.contact.points_per_circle)


def runs(
    at: Callable[[Case, Shares], Drawn], of: Sequence[Row], asked: Sequence[Shares], *, quantities: bool = False,
    task: str, jobs: int | None, progress: Progress,
) -> "pd.DataFrame":  # fmt: skip
    """Run every record of `of` at all `asked` shares, the first of which are nominal, and the nominal one finer.

    The rows are ordered by record: nominal, finer, and the further shares.
    """
    import pandas as pd

    each = [{"finer": n == 1, "shares": list(s), "quantities": quantities} for n, s in enumerate([asked[0], *asked])]
    cases = pd.DataFrame([record | one for record in of for one in each])

    def scene_of(case: Case) -> Scene:
        scene = at(case, case["shares"])[0]
        return finer(scene) if case["finer"] else scene

    return sweep(cases, scene_of, read_run, task=task, jobs=jobs, progress=progress)


def read_run(case: Case, tried: Attempt) -> Measures:
    """Cage ratio of a run, NaN if it failed, and the compared quantities by name where they are asked for."""
    if tried.run is None or not tried.works:
        return {"ratio": math.nan, "values": {}}
    values = {}
    if case["quantities"]:
        own = SimulationCase(id="inputs", purpose="inputs", state=Fault(case["state"]), scene=tried.scene)
        band_hz = paper_at(case, case["shares"], TURNS)[1]
        read = analyse_run(own, tried.run, load_bearing(tried.scene.bearing), band_hz).values
        values = {name: value.value for name, value in read.items()}
    return {"ratio": round(tried.run.cage_ratio, 8), "values": values}


def cage_draws(name: str, at: Sequence[Sequence[float]], *, jobs: int | None, progress: Progress) -> Row:
    """Cage ratios of a scene for all records: nominal, finer, each input alone, and at the draws `at` [draws, inputs].

    Values of the inputs at which the run of any record failed are left out for all records, and counted; a nominal run
    that fails is a `NumericsError`.
    """
    rig, of = name == "rig", records()
    inputs = {one.key: one.shares for one in rig_inputs()} if rig else {one.name: one.shares for one in open_inputs()}
    inputs, none = dict(list(inputs.items())[: len(at[0])]), [None] * len(at[0])
    alone = [(i, share) for i, shares in enumerate(inputs.values()) for share in shares]
    asked: list[Shares] = [none, *([*none[:i], share, *none[i + 1 :]] for i, share in alone), *at]
    task = f"Draws of the scene {name}"
    found = runs(rig_at if rig else paper_at, of, asked, task=task, jobs=jobs, progress=progress)
    ratios = found["ratio"].to_numpy(dtype=float).reshape(len(of), -1)
    kept = np.isfinite(ratios).all(axis=0)
    if not kept[:2].all():
        why = found["reason"][found["ratio"].isna()].iloc[0]
        raise NumericsError(f"a nominal run of the scene {name} failed: {why}")
    effects = []
    for i, title in enumerate(inputs):
        places = [n for n, (which, _) in enumerate(alone, start=2) if which == i and kept[n]]
        shares = [alone[n - 2][1] for n in places]
        effects.append({"name": title, "shares": shares, "ratios": ratios[:, places].tolist()})
    used = [n for n in range(2 + len(alone), ratios.shape[1]) if kept[n]]
    return {
        "scene": name,
        "failed": int(np.count_nonzero(~kept)),
        "records": [
            record | {"nominal": own[0], "finer": own[1], "drawn": own[used].tolist()}
            for record, own in zip(of, ratios, strict=True)
        ],
        "effects": effects,
        "at": np.array([asked[n - 1] for n in used], dtype=float).round(6).tolist(),
    }


def quantity_effects(at: Sequence[Sequence[float]], *, jobs: int | None, progress: Progress) -> Iterator[Row]:
    """Effects on every quantity of every fault that enough draws `at` [draws, inputs] show.

    A row has the nominal `value`, the `shift` to the mean over the draws, their standard `deviation`, `inputs_ci95` (a
    new draw lies within it of the mean with a chance of 95 %, by rank, since draws are not normal), `grid_ci95`
    (points on a circle and step) and `shares` (part of the variance by each input alone).
    """
    of = [one for one in records(tuple(DEFECTS)) if one["nominal_rpm"] == NOMINAL_RPM]
    asked: list[Shares] = [[None] * len(at[0]), *at]
    found = runs(
        lambda record, shares: paper_at(record, shares, TURNS), of, asked, quantities=True,
        task="Effects on quantities", jobs=jobs, progress=progress,
    )  # fmt: skip
    for state, own in found.groupby("state", sort=False)["values"]:
        nominal, fine, *others = own
        for row in (row for row in COMPARED if row.margin is not None):
            name = row.name_of(Fault(state))
            shown = [n for n, one in enumerate(others) if name in one]
            if name in nominal and len(shown) >= STUDY.least_read * len(others):
                values = np.array([others[n][name] for n in shown])
                own_shares = zip(open_inputs(), np.array(at)[shown].T, strict=True)
                yield {
                    "defect": state, "quantity": name, "unit": row.unit, "draws": len(shown),
                    **spread(values, nominal[name], fine.get(name, nominal[name])),
                    "shares": {one.name: share_of_variance(x, values) for one, x in own_shares},
                }  # fmt: skip


def spread(values: FloatArray, nominal: float, fine: float) -> Row:
    """The numbers of `quantity_effects` by the values at the draws, of the nominal run and of the finer one."""
    mean = float(values.mean())
    off = np.sort(np.abs(values - mean))
    return {
        "value": nominal,
        "shift": mean - nominal,
        "deviation": float(values.std(ddof=1)),
        "inputs_ci95": float(off[min(math.ceil(0.95 * (off.size + 1)), off.size) - 1]),
        "grid_ci95": STUDY.grid_factor * abs(fine - nominal),
    }


def share_of_variance(shares: FloatArray, values: FloatArray) -> float:
    """Part of the variance by one input alone: epsilon squared over bins of its range (Kelley 1935)."""
    place = np.minimum((shares * BINS).astype(int), BINS - 1)
    bins = [values[place == one] for one in np.unique(place)]
    within = sum(float(((own - own.mean()) ** 2).sum()) for own in bins) / max(values.size - len(bins), 1)
    total = float(values.var(ddof=1))
    return max(1 - within / total, 0.0) if total else 0.0


def true_ratios(variant: Mapping[str, Any], readings: Sequence[CageReading]) -> FloatArray:
    """Cage ratios of the scene at its draws for every reading, [records, draws]."""
    drawn_ratios = np.array([one["drawn"] for one in variant["records"]])
    return np.array([of_model(variant, [one], np.ones(1)) @ drawn_ratios for one in readings])


def power(
    variant: Mapping[str, Any], readings: Sequence[CageReading], *, rigs: int, progress: Progress = silent
) -> Iterator[Row]:
    """The shares of `rigs` simulated rigs with each verdict, a row for every endpoint and planted error."""
    known, truth = list(endpoints(readings, cage_means(readings))), true_ratios(variant, readings)
    cells = [(number, one, pct) for number, one in enumerate(known) for pct in PLANTED_PCT]
    for done, (number, endpoint, planted_pct) in enumerate(cells):
        rng, found = np.random.default_rng([SEED, number]), Counter[str]()
        for rig in range(rigs):
            progress("Simulate rigs", (done + rig / rigs) / len(cells))
            planted = 1 + planted_pct / 100 * rng.choice([-1, 1]) * (endpoint.weights > 0)
            read = read_again(readings, truth[:, rng.integers(truth.shape[1])] * planted, rng)
            means = cage_means(read)
            found[verdict(list(endpoints(read, means))[number], variant, read, means.means[-1])["verdict"]] += 1
        answers = (Verdict.MET, Verdict.MISSED, Verdict.NOT_RESOLVED)
        shares = {one.value.replace(" ", "_"): found[one.value] / rigs for one in answers}
        yield {"endpoint": endpoint.name, "planted_pct": planted_pct, **shares, "rigs": rigs}
    progress("Simulate rigs", 1.0)


def read_again(readings: Sequence[CageReading], ratios: FloatArray, rng: np.random.Generator) -> list[CageReading]:
    """Readings of records with these true ratios, between which records scatter besides."""
    scattered = ratios * (1 + STUDY.between_pct / 100 * rng.standard_normal(ratios.size))
    read = scattered + rng.multivariate_normal(np.zeros(ratios.size), covariance(readings))
    return [replace(one, ratio=ratio) for one, ratio in zip(readings, read.tolist(), strict=True)]


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    quick = QUICK_POWER if options.quick else None
    on, inputs = {"jobs": options.jobs, "progress": progress}, open_inputs()
    of_band = sum(one.keys[0].startswith(BAND) for one in inputs)  # they belong to the reading, and stand last
    cage_at = sobol(len(inputs) - of_band, quick or STUDY.paper_power)
    band_at = sobol(of_band, quick or STUDY.paper_power, seed=SEED)
    effects = list(quantity_effects([[*one, *band] for one, band in zip(cage_at, band_at, strict=True)], **on))
    variants = [cage_draws("paper", cage_at, **on)]
    variants += [cage_draws("rig", sobol(len(rig_inputs()), quick or STUDY.rig_power), **on)]
    readings = cage_readings(map(load_entry, rig_recordings()), load_bearing(DEFAULT_BEARING))
    rigs = QUICK_RIGS if options.quick else STUDY.rigs
    rates = list(power(variants[-1], readings, rigs=rigs, progress=progress))
    content = {"effects": effects, "variants": variants, "power": rates, "records": [one.record for one in readings]}
    shown = [{key: value for key, value in row.items() if key != "shares"} for row in effects]
    return StudyResult(
        name=None if options.quick else "inputs", content=content, text=f"{text_rows(shown)}\n\n{text_rows(rates)}"
    )
