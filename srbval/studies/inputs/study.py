"""Effects of uncertain inputs of the scenes `paper` and `rig` on the cage ratio and on all other compared quantities.

All inputs of a scene (the input of a simulation) are drawn at random together, and for the cage ratio each is varied
alone too. The cage ratio, cage over shaft speed, is simulated at the speeds of the records, other quantities at
`NOMINAL_RPM` with the scene `paper` alone. Theory: "The model's value".

How often the verdicts detect an error is counted on simulated rigs. A simulated rig has the registered records with
their uncertainties. Its true cage ratios are those of the scene `rig` at one random draw, with an error planted in one
compared value. Signals are not simulated.
"""

import math
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from srbval.arrays import FloatArray
from srbval.bearing import DEFAULT_BEARING, DEFECTS, RACE_DEFECTS, Fault, load_bearing
from srbval.comparison.cage_means import cage_means, covariance
from srbval.comparison.cage_readings import CageReading, cage_readings
from srbval.comparison.compared_quantities import COMPARED
from srbval.comparison.comparison import STUDY, Row, paper_inputs
from srbval.comparison.counterpart import DETAIL_HZ, TURNS, analyse_run, converged, with_points
from srbval.comparison.table6 import published_speeds
from srbval.comparison.verdicts import endpoints, of_model, verdict
from srbval.errors import NumericsError
from srbval.models.run_file import scene_dict
from srbval.progress import Progress, silent
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings.registry import load_entry, rig_recordings
from srbval.scene import Scene, changes_at, load_scene, merge, paper_scene, rig_inputs, sobol
from srbval.storage.tables import build, walk_leaves
from srbval.studies.harness import StudyResult
from srbval.sweep.pool import Attempt
from srbval.sweep.sweep import Case, Measures, sweep

Shares = Sequence[float | None]  # of the range of each input; None is the nominal value
CAGE_TURNS = 3.0  # of the shaft: the cage ratio differs from that of thirty turns by less than 1e-5 of it
# Twelve roller passages: the cage ratio differs from that of two seconds by less than 1e-6 of it. The scene's own step
# exceeds the stiffest roller's limit where contacts are longest.
RIG_RUN = {"settle_s": 0.05, "duration_s": 0.1, "solver": {"step_s": 1 / 61_440}}
FINE_SLICES = 61
# A roller's fault lowers the paper's cage ratio by 2e-5 of it: its records use the run of the healthy bearing.
CAGE_STATES = (Fault.HEALTHY, *RACE_DEFECTS)
NOMINAL_RPM = 877.0  # the rig's speed with open recordings of all faults
PLANTED_PCT, SEED = (0.0, 0.05, 0.1, 0.2), 36


def records(states: Sequence[Fault]) -> list[Row]:
    """State and mean speed of the rig's published records with one of `states`."""
    return [
        {"state": mean.state.value, "nominal_rpm": mean.nominal_rpm, "shaft_rpm": mean.mean_rpm}
        for mean in published_speeds().means
        if mean.state in states
    ]


def drawn_scene(case: Case) -> tuple[Scene, tuple[float, float]]:
    """Scene (input of a simulation) with the speed and drawn values of a case, and the band of the envelope [Hz]."""
    rpm, state, shares = case["shaft_rpm"], Fault(case["state"]), case["shares"]
    if case["scene"] == "rig":
        own = {"defect": {"kind": state}, "shaft_speed": f"{rpm} rpm"}
        return load_scene("rig", merge(merge(own, RIG_RUN), changes_at(rig_inputs(), shares))), SIMULATED_BAND_HZ
    scene = paper_scene(
        shaft_speed_rad_s=2 * math.pi * rpm / 60,
        duration_s=60 * case["turns"] / rpm,
        defect={"kind": state},
        detail_rate_hz=DETAIL_HZ.get(state, 0.0),
    )
    table = scene_dict(converged(scene))
    changes = changes_at(paper_inputs()[: len(shares)], shares, dict(walk_leaves(table)))
    band = dict(zip(("low_hz", "high_hz"), SIMULATED_BAND_HZ, strict=True)) | changes.pop("band", {})
    return build(Scene, merge(table, changes), "inputs"), (band["low_hz"], band["high_hz"])


def scene_of(case: Case) -> Scene:
    """Scene of a case; if `finer`, with half the step and twice the contact points per circle or more roller slices."""
    scene = drawn_scene(case)[0]
    if not case["finer"]:
        return scene
    halved = replace(scene, solver=replace(scene.solver, step_s=scene.solver.step_s / 2))
    if scene.model == "slices":
        return replace(halved, line_contact=replace(scene.line_contact, slices=FINE_SLICES))
    return with_points(halved, 2 * scene.contact.points_per_circle)


def read_run(case: Case, tried: Attempt) -> Measures:
    """Cage ratio of a run, NaN if it failed, and the compared quantities by name if the run is long enough."""
    if tried.run is None or not tried.works:
        return {"ratio": math.nan, "values": {}}
    values = {}
    if case["turns"] == TURNS:
        read = analyse_run(tried.run, load_bearing(tried.scene.bearing), drawn_scene(case)[1])
        values = {name: value.value for name, value in read.values.items()}
    return {"ratio": round(tried.run.cage_ratio, 8), "values": values}


def runs(name: str, of: Sequence[Row], asked: Sequence[Shares], turns: float, **options: Any) -> pd.DataFrame:
    """Run scene `name` for every record in `of`, with every set of inputs in `asked`, for `turns` shaft revolutions.

    A set contains the cumulative probability of each input; the first set is also run at a finer step.
    """
    each = [{"finer": n == 1, "shares": list(shares)} for n, shares in enumerate([asked[0], *asked])]
    cases = pd.DataFrame([{"scene": name, "turns": turns} | record | one for record in of for one in each])
    return sweep(cases, scene_of, read_run, task=f"Inputs of the scene {name}", **options)


def cage_draws(name: str, at: Sequence[Sequence[float]], **options: Any) -> Row:
    """Cage ratios for all records: with nominal inputs, a finer step, each input varied alone, and all at random.

    `at`, shape [draws, inputs], contains cumulative probabilities of the inputs. Input values at which a run fails are
    left out and counted. Raises `NumericsError` if a nominal run fails.
    """
    inputs = rig_inputs() if name == "rig" else paper_inputs()[: len(at[0])]
    of_scene = [(one.name or one.keys[0], one.shares) for one in inputs]
    of, none = records(CAGE_STATES), [None] * len(of_scene)
    alone = [(i, share) for i, (_, shares) in enumerate(of_scene) for share in shares]
    asked: list[Shares] = [none, *([*none[:i], share, *none[i + 1 :]] for i, share in alone), *at]
    found = runs(name, of, asked, CAGE_TURNS, **options)
    ratios = found["ratio"].to_numpy(dtype=float).reshape(len(of), -1)
    kept = np.isfinite(ratios).all(axis=0)
    if not kept[:2].all():
        raise NumericsError(f"scene {name}: a nominal run failed: {found['reason'][found['ratio'].isna()].iloc[0]}")
    places = [[n for n, (which, _) in enumerate(alone, start=2) if which == i and kept[n]] for i in range(len(none))]
    used = [n for n in range(2 + len(alone), ratios.shape[1]) if kept[n]]
    return {
        "scene": name,
        "failed": int(np.count_nonzero(~kept)),
        "records": [
            record | {"nominal": own[0], "finer": own[1], "drawn": own[used].tolist()}
            for record, own in zip(of, ratios, strict=True)
        ],
        "effects": [
            {"name": title, "shares": [alone[n - 2][1] for n in own], "ratios": ratios[:, own].tolist()}
            for (title, _), own in zip(of_scene, places, strict=True)
        ],
        "at": np.array([asked[n - 1] for n in used], dtype=float).round(6).tolist(),
    }


def quantity_effects(at: Sequence[Sequence[float]], **options: Any) -> Iterator[Row]:
    """Effects of the inputs on every quantity of every fault, from the draws `at`, shape [draws, inputs].

    A row has the nominal `value`, the `shift` to the mean over the draws, `inputs_ci95` (half width that contains 95 %
    of new draws) and `grid_ci95` (effect of contact points and step).
    """
    of = [one for one in records(tuple(DEFECTS)) if one["nominal_rpm"] == NOMINAL_RPM]
    found = runs("paper", of, [[None] * len(at[0]), *at], TURNS, **options)
    for state, (nominal, fine, *others) in found.groupby("state", sort=False)["values"]:
        for row in COMPARED:
            name = row.name_of(Fault(state))
            values = np.array([one[name] for one in others if name in one])
            if name not in nominal or values.size < STUDY.least_read * len(others):
                continue
            off = np.sort(np.abs(values - values.mean()))
            yield {
                "defect": state,
                "quantity": name,
                "unit": row.unit,
                "draws": values.size,
                "value": nominal[name],
                "shift": float(values.mean()) - nominal[name],
                "inputs_ci95": float(off[min(math.ceil(0.95 * (off.size + 1)), off.size) - 1]),
                "grid_ci95": STUDY.grid_factor * abs(fine.get(name, nominal[name]) - nominal[name]),
            }


def power(
    variant: Mapping[str, Any], readings: Sequence[CageReading], *, rigs: int, progress: Progress = silent
) -> Iterator[Row]:
    """Shares of the verdicts met, missed and not resolved on `rigs` simulated test rigs, by value and planted error."""
    drawn_ratios = np.array([one["drawn"] for one in variant["records"]])
    truth = np.array([of_model(variant, [one], np.ones(1)) @ drawn_ratios for one in readings])
    known = list(endpoints(readings, cage_means(readings)))
    cells = [(number, one, pct) for number, one in enumerate(known) for pct in PLANTED_PCT]
    for done, (number, endpoint, planted_pct) in enumerate(cells):
        rng, found = np.random.default_rng([SEED, number]), Counter[str]()
        for rig in range(rigs):
            progress("Simulate rigs", (done + rig / rigs) / len(cells))
            planted = 1 + planted_pct / 100 * rng.choice([-1, 1]) * (endpoint.weights > 0)
            read = read_again(readings, truth[:, rng.integers(truth.shape[1])] * planted, rng)
            means = cage_means(read)
            found[verdict(list(endpoints(read, means))[number], variant, read, means.means[-1])["verdict"]] += 1
        shares = {one.replace(" ", "_"): found[one] / rigs for one in ("met", "missed", "not resolved")}
        yield {"endpoint": endpoint.name, "planted_pct": planted_pct, **shares, "rigs": rigs}
    progress("Simulate rigs", 1.0)


def read_again(readings: Sequence[CageReading], ratios: FloatArray, rng: np.random.Generator) -> list[CageReading]:
    """Simulate readings of records from true cage `ratios`, with scatter between records and reading errors."""
    scattered = ratios * (1 + STUDY.between_pct / 100 * rng.standard_normal(ratios.size))
    read = scattered + rng.multivariate_normal(np.zeros(ratios.size), covariance(readings))
    return [replace(one, ratio=ratio) for one, ratio in zip(readings, read.tolist(), strict=True)]


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Compute how uncertain inputs change the results, and how often verdicts detect errors planted in simulations."""
    of_band = sum(one.keys[0].startswith("band.") for one in paper_inputs())  # these come last
    cage_at = sobol(len(paper_inputs()) - of_band, STUDY.paper_power)
    at = [[*one, *band] for one, band in zip(cage_at, sobol(of_band, STUDY.paper_power, seed=SEED), strict=True)]
    on = {"jobs": options.jobs, "progress": progress}
    effects = list(quantity_effects(at, **on))
    variants = [cage_draws("paper", cage_at, **on), cage_draws("rig", sobol(len(rig_inputs()), STUDY.rig_power), **on)]
    readings = cage_readings(map(load_entry, rig_recordings()), load_bearing(DEFAULT_BEARING))
    rates = list(power(variants[-1], readings, rigs=STUDY.rigs, progress=progress))
    content = {"effects": effects, "variants": variants, "power": rates, "records": [one.record for one in readings]}
    tables = (pd.DataFrame(effects), pd.DataFrame(rates))
    text = "\n\n".join(table.to_string(index=False, float_format="{:.4g}".format) for table in tables)
    return StudyResult(name="inputs", content=content, text=text)
