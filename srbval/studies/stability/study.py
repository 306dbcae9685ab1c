"""Largest step that `srbval simulate` accepts, by scene, solver and speed, found by bisection."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from operator import itemgetter
from typing import Any

import pandas as pd

from srbval.bearing import load_bearing
from srbval.models.estimates import ERROR_TOLERANCE as TOLERANCE
from srbval.models.health import ENERGY_LIMIT, FORCE_LIMIT, SLIDING, STEP_LIMIT
from srbval.models.simulate import Step
from srbval.models.solvers import SOLVERS
from srbval.models.step_limits import predict
from srbval.progress import Progress
from srbval.progress.tables import text_table
from srbval.scene import Scene
from srbval.studies.harness import StudyResult
from srbval.studies.stability.claims import claims
from srbval.sweep.pool import Attempt, side_by_side
from srbval.sweep.scenes import bench_scene, lasting_passages
from srbval.sweep.sweep import Case, bisect, grid, records

SCENES = ("play0-outer", "interference-outer", "rig-outer")
RPM = (127.0, 355.0, 710.0, 1000.0, 1500.0, 3000.0, 6000.0)
# Divisors of a second. Bisection runs the middle one first: the paper's, so that every line has a cell at its step.
STEPS_PER_S = (245760, 122880, 81920, 61440, 40960, 30720, 20480, 10240)
PASSAGES, SETTLE_PASSAGES, LEAST_S = 4.0, 2.0, 0.25  # roller passages in a run and before it; least duration
# Limits that a run must keep to work, the same as in `srbval simulate`.
LIMITS = {**TOLERANCE, "sliding_cage": SLIDING, "energy": ENERGY_LIMIT, "force": FORCE_LIMIT, "step": STEP_LIMIT}
Row = dict[str, Any]


def scene_of(case: Case) -> Scene:
    """Scene of a case (scene, solver, speed and step); its duration depends on the speed alone."""
    scene = bench_scene(
        case["scene"], solver=str(case["solver"]), step_s=1 / case["steps_per_s"], rpm=float(case["rpm"])
    )
    return lasting_passages(scene, PASSAGES, least_s=LEAST_S, settle=SETTLE_PASSAGES)


def measure(_: Case, own: Attempt) -> Row:
    """Quantities of a run; `points_per_step`: contact points of an inner-race circle that pass a roller in a step."""
    scene, bearing = own.scene, load_bearing(own.scene.bearing)
    passing_hz = bearing.orders.at(scene.shaft_hz).bpfi_hz / bearing.rolling_elements
    return {
        "model": scene.model,
        "dt_s": scene.solver.step_s,
        "stable": own.works,
        "points_per_step": scene.contact.points_per_circle * passing_hz * scene.solver.step_s,
        "energy_imbalance": None if own.run is None else own.run.energy_imbalance,
        "band_rms_m_s2": None if own.run is None else own.run.band_rms_m_s2["500-1500"],
    }


def run_stability(
    *,
    scenes: Sequence[str] = SCENES,
    solvers: Sequence[str] = SOLVERS,
    rpm: Sequence[float] = RPM,
    steps_per_s: Sequence[int] = STEPS_PER_S,
    **how: Any,
) -> Row:
    """Find and predict the largest stable step of every scene, solver and speed, and test the paper's claims.

    A step is stable if the run works (see `srbval.models.run.works`); the step error is estimated in every run. `how`:
    `jobs` and `progress`. Raises `ConfigurationError` for an unknown scene or solver.
    """
    groups, steps = (
        grid(scene=list(scenes), solver=list(solvers), rpm=list(rpm)),
        pd.Series(steps_per_s, name="steps_per_s"),
    )
    lines, cells = bisect(groups, steps, scene_of, measure, itemgetter("stable"), step=Step.CHECKED, **how)
    predicted = predictions(groups, **how)
    lines = lines.merge(predicted).assign(
        model=cells.groupby("scene")["model"].first().reindex(lines["scene"]).to_numpy(),
        largest_stable_dt_s=1 / lines["steps_per_s"],
    )
    cells = cells.merge(predicted).sort_values(["scene", "solver", "rpm", "steps_per_s"])
    found = records(cells.drop(columns="steps_per_s"))
    return {
        "steps_per_s": list(steps_per_s),
        "tolerances": LIMITS,
        "claims": claims(found),
        "limits": records(lines.drop(columns="steps_per_s")),
        "cells": found,
    }


def predictions(groups: pd.DataFrame, **how: Any) -> pd.DataFrame:
    """Predict the largest stable steps [s] for scene, solver and speed of `groups`, with friction and without."""
    solvers = list(groups["solver"].unique())
    scenes = {
        (row["scene"], row["rpm"]): scene_of(row | {"steps_per_s": STEPS_PER_S[0]})
        for row in groups.drop_duplicates(["scene", "rpm"]).to_dict("records")
    }
    found = side_by_side(scenes, lambda key, _: predict(scenes[key], solvers), task="linear theory", **how)
    return pd.DataFrame([
        {"scene": scene, "rpm": rpm, "solver": name, "predicted_limit_dt_s": whole_s,
         "predicted_elastic_limit_dt_s": elastic_s}
        for (scene, rpm), by_solver in found.items() for name, (whole_s, elastic_s) in by_solver.items()
    ])  # fmt: skip


def steps_by_speed(limits: Sequence[Row]) -> pd.DataFrame:
    """Table of the fewest steps per simulated second of a stable run, by scene and solver, with a column per speed."""
    frame = pd.DataFrame(limits).astype({"largest_stable_dt_s": float})
    frame = frame.assign(steps=1 / frame["largest_stable_dt_s"], speed=[f"{rpm:g} rpm" for rpm in frame["rpm"]])
    table = frame.pivot(index=["scene", "solver"], columns="speed", values="steps")
    return table[frame["speed"].unique()].reset_index()


def answer_text(result: Mapping[str, Any]) -> str:
    """Text with the largest stable steps by speed and the tested claims."""
    steps = steps_by_speed(result["limits"])
    table = text_table(tuple(steps.columns), steps.to_numpy().tolist())
    answers = "\n".join(claim["answer"] for claim in result["claims"])
    return f"Largest stable steps, as divisors of a second (-: none tried):\n\n{table}\n\n{answers}"


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Find the largest stable time steps; a partial or quick search is stored only if the user names a file."""
    given = {name: tuple(own) for name in ("scenes", "solvers", "rpm") if (own := getattr(options, name))}
    small = {"scenes": SCENES[:1], "rpm": (710.0, 3000.0)} if options.quick else {}
    found = run_stability(**small | given, jobs=options.jobs, progress=progress)
    return StudyResult(name=None if given or small else "stability", content=found, text=answer_text(found))
