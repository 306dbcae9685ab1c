"""Data of the main report's sections and figures, and the tables of ``report.json`` that are computed from them."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import Bearing, Fault
from srbval.comparison.cage_means import CageMeans, cage_means
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.compared_quantities import RACE_LINE, biases
from srbval.comparison.comparison import VERDICT, Row, comparison_frame, plain_frame, verdict_on_error
from srbval.comparison.counterpart import AnalysedRun
from srbval.comparison.table6 import check_table6_sums, measured_rows, published_rows, table6
from srbval.comparison.verdicts import none_missed, verdicts
from srbval.models.run import Run
from srbval.models.run_file import scene_dict
from srbval.reading.analyse import Analysis
from srbval.recordings.datasets.description import DatasetDescription
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import RegisterListing
from srbval.report.blocks import REPORT_SCHEMA
from srbval.report.findings.records import RecordView, power_share_near_line
from srbval.report.pages import StoredResults, stored_content
from srbval.signal import NORMAL_95, kurtosis
from srbval.storage.json_files import to_json
from srbval.sweep.sweep import records
from srbval.validation.compare import LINE_QUANTITIES, PAIR_KEYS
from srbval.validation.validate import Validation

INTERVAL_QUANTILES = (0.025, 0.5, 0.975)  # ends of the 95 % interval and median


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """Content of ``report.json`` (`data`), and the runs, analyses and arrays behind the sections and figures.

    `validation` covers every recording of the rig. `analyses` contains one analysis for each side and bearing state;
    the sides are ``paper`` (model at the paper's 710 rpm), ``rig`` (one recording per state) and ``model`` (model at
    the speed of that recording). `views` (arrays for figures) has only the sides ``model`` and ``rig``. The keys of
    `runs` are ids of simulation cases.
    """

    data: Mapping[str, Any]
    bearing: Bearing
    runs: Mapping[str, Run]
    analyses: Mapping[str, Mapping[Fault, Analysis]]
    views: Mapping[str, Mapping[Fault, RecordView]]
    validation: Validation
    datasets: tuple[DatasetDescription, ...]
    results: StoredResults
    provenance: Mapping[str, Any]

    def sides_of(self, state: Fault) -> list[RecordView]:
        """Return the arrays of the model's record, then of the rig's record, of a bearing with the fault `state`."""
        return [side[state] for side in self.views.values()]

    def frame(self, key: str) -> pd.DataFrame:
        """Return the table stored under `key` in ``report.json``, such as ``table6``, as a data frame."""
        return plain_frame(to_json(list(self.data[key])))


def compared_rows(
    found: Findings,
    models: Mapping[Fault, AnalysedRun],
    readings: Sequence[CageReading],
    register: RegisterListing,
    registered: Sequence[RegisteredRecording],
) -> dict[str, Any]:
    """Compute the content of ``report.json``, without provenance and studies, from the runs and analyses in `found`.

    `models` are analysed runs at the speeds of the rig's recordings, `readings` cage ratios measured on the rig,
    `register` lists all known recordings, `registered` are those that the figures show.
    """
    printed, bearing, runs = table6(), found.bearing, found.runs
    every, pairs = select_comparisons(found.validation.comparisons), found.validation.pairs.to_dict("records")
    shown = {rig.recording.file or rig.recording.name for rig in found.analyses["rig"].values()}
    comparisons = every[every["record"].isin(shown)]
    model_runs = {state: side.run for state, side in models.items()}
    paper, rig = (found.analyses[side] for side in ("paper", "rig"))
    stored = stored_content(found.results, "inputs")
    of_shown = (row for row in found.validation.comparisons if row["record"] in shown)
    measured = [
        row | rig_scene_line(row["defect"], rig[row["defect"]], stored) for row in measured_rows(of_shown, model_runs)
    ]
    published = list(published_rows(printed, paper, runs))
    lines = [*published, *measured]
    keys = dict.fromkeys(key for one in lines for key in one)
    rows, means = verdicts(readings, stored), cage_means(readings)
    ratios = list(cage_ratio_rows(readings, means, stored, bearing.orders.ftf))
    change = trend_row(means, rows)
    levels, amplitudes = records(comparisons), stored_content(found.results, "amplitudes").get("rows", ())
    return {
        "schema_version": REPORT_SCHEMA,
        "status": "ok",
        "headline": {"holds": none_missed(rows), "verdicts": rows},
        "verdicts": rows,
        "cage_readings": readings,
        "cage_ratios": ratios,
        "trend": change,
        "near": [*near_cage_rows(rows, ratios, change), *near_level_rows(levels, amplitudes)],
        "table6": [keys | row for row in lines],  # a missing value is None
        "closure": tuple(check_table6_sums(published, measured, bearing.rolling_elements)),
        "comparisons": levels,
        "pairs": pairs,
        "recordings": tuple(registered),
        "problems": list_problems(register, pairs),
        "bias": biases(every, used_for="withheld"),
        "pictures": [row for state in models for row in picture_rows(state, found.sides_of(state), levels)],
        "runs": [run_facts(name, run) for name, run in runs.items()],
        "scene": scene_dict(runs["paper-outer"].scene) | {"geometry": vars(bearing.geometry)},
    }


def run_facts(name: str, run: Run) -> Row:
    """Describe a run, by its `name`, for ``report.json``; ``numerics``: its estimated time-step error, or None."""
    scene, step_error = run.scene, run.step_error
    names = ("seconds", "status", "reason", "cpu_per_simulated_s", "cage_ratio", "energy_imbalance")
    about = {"id": name, "model": scene.model, "shaft_rpm": 60 * scene.shaft_hz}
    about |= {"solver": scene.solver.name, "step_s": scene.solver.step_s}
    return about | {name: getattr(run, name) for name in names} | {"numerics": step_error and step_error.to_dict()}


def rig_scene_line(fault: Fault, analysis: Analysis, stored: Mapping[str, Any]) -> Row:
    """Return mean and 95 % half width [Hz] of the line of `fault` in runs of the scene `rig` with varied inputs.

    The runs, at the speed of the analysed record, are in the stored result of the study ``inputs`` (`stored`).
    """
    point = (fault, analysis.recording.nominal_rpm)
    records = [record for one in stored.get("variants", ()) if one["scene"] == "rig" for record in one["records"]]
    drawn = next((one["drawn"] for one in records if (one["state"], one["nominal_rpm"]) == point), None)
    if drawn is None:
        return {"rig_scene_hz": None, "rig_scene_ci95_hz": None}
    elements, shaft_hz = analysis.bearing.rolling_elements, analysis.speed.value_hz
    hz = [shaft_hz * (fault.passing_order(elements, ratio) or math.nan) for ratio in drawn]
    low, _, high = np.quantile(hz, INTERVAL_QUANTILES)
    return {"rig_scene_hz": float(np.mean(hz)), "rig_scene_ci95_hz": float(high - low) / 2}


def picture_rows(state: Fault, views: Sequence[RecordView], levels: Iterable[Row]) -> Iterator[Row]:
    """Judge if figures of model and rig are alike: by kurtosis, `levels` of lines, and power near the fault line."""
    about = {"state": state.value, "kind": "acceleration"}
    filtered = (one.analysis.processed.filtered for one in views)
    model, rig = (kurtosis(signal - signal.mean()) for signal in filtered)
    yield about | alike_row("kurtosis", model, rig)
    for row in levels:
        known = row["error_unit"] == "dB" and row["error"] is not None and not math.isnan(row["error"])
        if known and row["state"] == state:
            yield about | alike_row(row["quantity"], row["model"], row["rig"], "dB") | {"kind": "spectrum"}
    if state.line:
        model, rig = (power_share_near_line(one.scalogram, one.analysis.line_of(state).kinematic_hz) for one in views)
        yield about | alike_row(f"share of power at {state.line}", model, rig) | {"kind": "scalogram"}


def alike_row(what: str, model: float, rig: float, unit: str = "") -> Row:
    """Judge if model and rig differ by at most a limit: some dB if `unit` is dB, else a share of the rig's value."""
    limit = VERDICT.level_db if unit == "dB" else VERDICT.share_pct / 100 * abs(rig)
    return {"what": what, "unit": unit, "model": model, "rig": rig, "limit": limit, "alike": abs(model - rig) <= limit}


def near_cage_rows(judged: Iterable[Row], ratios: Iterable[Row], change: Row) -> list[Row]:
    """List the rig's cage ratios (`ratios`) and their `change` with speed, each with the model's errors (`judged`)."""
    rig = {f"{one['nominal_rpm']:g} rpm": one for one in ratios if one["of"] == "mean"}
    known = {name: (one["ratio"], (one["high"] - one["low"]) / 2, "") for name, one in rig.items()}
    known[change["endpoint"]] = change["rig_pct"], change["rig_ci95_pct"], "%"
    rows = dict[str, Row]()
    for one in judged:
        value, ci95, unit = known.get(one["endpoint"], (None, None, ""))
        of_rig = {"rig": value, "rig_ci95": ci95, "unit": unit, "error_unit": "%"}
        row = rows.setdefault(one["endpoint"], {"quantity": f"cage ratio, {one['endpoint']}"} | of_rig)
        row |= _error_of(one["scene"], one["error_pct"], one["u_pct"], one["verdict"])
    return list(rows.values())


def _error_of(scene: str, error: float, u: float | None, verdict: str) -> Row:
    return {f"{scene}_error": error, f"{scene}_error_ci95": u, f"{scene}_error_note": verdict}


def near_level_rows(comparisons: Iterable[Row], amplitudes: Iterable[Row]) -> Iterator[Row]:
    """List levels of lines measured on the rig, each with the model's errors [dB] in the scenes `paper` and `rig`.

    The errors in the scene `paper` are in `comparisons`, those in the scene `rig` in `amplitudes`.
    """
    own = {(one["record"], one["quantity"]): one for one in amplitudes if one["kind"] == "harmonic pattern"}
    levels = [one for one in comparisons if one["error_unit"] == "dB"]
    for one in sorted(levels, key=lambda one: list(Fault).index(one["state"])):
        record = Path(one["record"]).stem
        row = {"quantity": one["quantity"], "record": record, "unit": "dB", "error_unit": "dB", "rig": one["rig"]}
        row |= {"rig_ci95": one["rig_ci95"]} | _error_of("paper", one["error"], one["uncertainty"], one["verdict"])
        if other := own.get((record, one["kind"])):
            error, u = other["error"], other["uncertainty"]
            seen = "fitted" if other["used_for"] == "fit" else verdict_on_error(error, u, VERDICT.level_db).value
            row |= _error_of("rig", error, u, seen)
        yield row


def select_comparisons(rows: Iterable[Row]) -> pd.DataFrame:
    """Select the comparisons of records in which the fault's line is detected, except those of BPFO and BPFI.

    The cage ratio contains the same information, and its errors may be averaged over outer and inner race faults.
    Errors of BPFO and BPFI must not be averaged: slip lowers BPFO and raises BPFI.
    """
    frame = comparison_frame(rows)
    lines = frame[frame["kind"].isin([one.kind for one in LINE_QUANTITIES]) & frame["rig_present"].astype(bool)]
    kept = frame["pair"].isin(lines["pair"]) & (frame["kind"] != RACE_LINE.kind) & frame["error"].notna()
    return frame[kept].sort_values("pair", kind="stable").drop(columns=list(PAIR_KEYS))


def list_problems(register: RegisterListing, pairs: Iterable[Row]) -> list[dict[str, str]]:
    """List recordings of the `register` that cannot be used, and once each caution on a measured record of `pairs`."""
    unusable = [(Path(one.file).name, f"not used, {one.status.value}; {one.reason or ''}") for one in register.problems]
    once = dict.fromkeys((Path(p["measured"][0]).name, one) for p in pairs for one in p["measured_facts"]["cautions"])
    return [{"file": file, "problem": problem} for file, problem in (*unusable, *once)]


def cage_ratio_rows(
    readings: Sequence[CageReading], means: CageMeans, stored: Mapping[str, Any], kinematic: float
) -> Iterator[Row]:
    """List cage ratios by speed: rig (`readings`, `means`), model by scene (`stored`), pure rolling (`kinematic`)."""
    for place, rpm in enumerate(means.rpm):
        for one in (one for one in readings if one.nominal_rpm == rpm):
            half = NORMAL_95 * float(np.hypot(one.reading_u, one.speed_u))
            yield _cage_ratio_row("record", rpm, (one.ratio - half, one.ratio, one.ratio + half), one.state.code)
        yield _cage_ratio_row("mean", rpm, np.quantile(means.draws[:, place], INTERVAL_QUANTILES))
        for variant in stored.get("variants", ()):
            own = [one["drawn"] for one in variant["records"] if one["nominal_rpm"] == rpm]
            if own:
                yield _cage_ratio_row(variant["scene"], rpm, np.quantile(np.mean(own, axis=0), INTERVAL_QUANTILES))
        yield _cage_ratio_row("kinematics", rpm, (kinematic,) * 3)


def _cage_ratio_row(of: str, rpm: float, interval: Iterable[float], state: str = "") -> Row:
    low, ratio, high = map(float, interval)
    return {"of": of, "state": state, "nominal_rpm": rpm, "ratio": ratio, "low": low, "high": high}


def trend_row(means: CageMeans, judged: Iterable[Row]) -> Row:
    """Compute the cage ratio's change [%] from fastest to slowest speed: rig (`means`), model (from `judged`)."""
    drawn = 100 * (means.draws[:, 0] / means.draws[:, -1] - 1)
    low, _, high = np.quantile(drawn, INTERVAL_QUANTILES)
    rig, ci95 = float(drawn.mean()), float(high - low) / 2
    name = f"{means.rpm[0]:g} less {means.rpm[-1]:g} rpm"
    own = next((one for one in judged if (one["scene"], one["endpoint"]) == ("rig", name)), None)
    return {
        "endpoint": name,
        "records": list(means.records),
        "rig_pct": rig,
        "rig_ci95_pct": ci95,
        "between_records_pct": 100 * means.between_u / means.means[-1],
        "between_records_ci95_pct": [100 * end / means.means[-1] for end in means.between_ci95],
        "model_pct": own and rig + own["error_pct"],
        "u_pct": own and own["u_pct"],
        "verdict": own and own["verdict"],
    }
