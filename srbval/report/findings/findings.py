"""Findings of the main report: simulations, analyses, comparisons, and the tables of ``report.json`` from them."""

import math
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.comparison.cage_means import CageMeans, cage_means
from srbval.comparison.cage_readings import CageReading, cage_readings
from srbval.comparison.compared_quantities import LINE_QUANTITIES, RACE_LINE, biases
from srbval.comparison.comparison import VERDICT, Row, comparison_frame, verdict_on_error
from srbval.comparison.counterpart import PAPER_STATES, AnalysedRun, paper_runs, run_counterpart
from srbval.comparison.table6 import PAPER_CASE, check_table6_sums, measured_rows, published_rows, table6
from srbval.comparison.verdicts import none_missed, verdicts
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.models.run import Run
from srbval.models.run_file import scene_dict
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analysis_once
from srbval.recordings import recording_from_run
from srbval.recordings.datasets.description import DatasetDescription, dataset
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import RegisterListing, listing, load_entry, rig_recordings
from srbval.report.blocks import REPORT_SCHEMA
from srbval.report.findings.records import RecordView, power_share_near_line, record_view
from srbval.report.pages import Page, StoredResults, load_newest_results, provenance, stored_content
from srbval.signal import NORMAL_95, kurtosis
from srbval.storage.content_store import ContentStore, content_sha256
from srbval.storage.tables import build
from srbval.sweep.sweep import records
from srbval.validation.compare import PAIR_KEYS
from srbval.validation.validate import PairReading, Validation, validate

CAGE_STORE = ContentStore(kind="cage", computed_by="srbval.comparison.cage_readings")
MIN_SIMULATED_S = 1.0  # below this the envelope spectrum cannot separate the lines from shaft harmonics
INTERVAL_QUANTILES = (0.025, 0.5, 0.975)  # ends of the 95 % interval and median


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """Content of ``report.json`` (`data`), and what else the sections and figures show.

    `views` contains the arrays of figures by side and bearing state: ``model`` is the model at the speed of the
    recording of the side ``rig``. `datasets` are the data sets of the rig's recordings, `results` the stored results
    of studies.
    """

    data: Mapping[str, Any]
    views: Mapping[str, Mapping[Fault, RecordView]]
    datasets: tuple[DatasetDescription, ...]
    results: StoredResults
    provenance: Mapping[str, Any]


def gather(
    *, seconds: float, pages: Iterable[Page] = (), jobs: int | None = None, progress: Progress = silent
) -> Findings:
    """Simulate the paper's cases and analyse them with the registered recordings of the rig; see `make_report`.

    Raises `ConfigurationError` if `seconds` is too short, `NumericsError` if a run fails, `DataError` if a bearing
    state has no readable recording, and the errors of loading a recording.
    """
    if seconds < MIN_SIMULATED_S:
        raise ConfigurationError(
            f"{seconds:g} s are too short to separate lines from shaft harmonics: use {MIN_SIMULATED_S:g} s or more."
        )
    bearing, results = load_bearing(DEFAULT_BEARING), load_newest_results(pages, "inputs")
    with stage(progress, "Look up the registered recordings"):
        register = listing()
        of_rig = select_at_paper_load(rig_recordings(register.recordings))
    runs = paper_runs(seconds, jobs=jobs, progress=progress)
    stored, entries = stored_content(results, "inputs"), {one.file: one for one in of_rig}
    read = defaultdict[float, dict[Fault, PairReading]](dict)  # at the paper's load, by nominal speed and state

    def keep(one: PairReading) -> None:
        recording = one.sides["measured"].analyses[0].recording
        if recording.file in entries and recording.nominal_rpm and recording.seconds >= MIN_SIMULATED_S:
            read[recording.nominal_rpm][one.state] = one

    validation = validate(PAPER_CASE, found=keep, jobs=jobs, progress=progress)
    chosen = choose_speed(read)
    require_states(chosen, validation.failed)
    rig, models = dict[Fault, Analysis](), dict[Fault, AnalysedRun]()
    for state in PAPER_STATES:
        rig[state], simulated = chosen[state].sides["measured"].analyses[0], chosen[state].sides.get("simulated")
        if chosen[state].problem:
            raise NumericsError(f"the simulation at the speed of the {state} recording failed: {chosen[state].problem}")
        model = simulated and simulated.model  # none for a healthy bearing
        models[state] = model or run_counterpart(rig[state], state, progress=progress)
    model_runs = {state: side.run for state, side in models.items()}
    runs |= {f"counterpart-{rig[state].recording.name}": run for state, run in model_runs.items()}
    with stage(progress, "Read the cage ratio of every record"):
        data = cage_rows(read_cage_ratios(of_rig, stored, bearing), stored, bearing.orders.ftf)
    with stage(progress, "Analyse the paper's runs"):
        paper = {s: analysis_once(recording_from_run(runs[f"paper-{s}"]), bearing) for s in PAPER_STATES}
    data |= line_rows(validation, runs, model_runs, paper, rig, stored)
    with stage(progress, "Prepare the records that figures show"):
        sides = {"model": {state: side.analysis for state, side in models.items()}, "rig": rig}
        views = {name: {state: record_view(one) for state, one in of.items()} for name, of in sides.items()}
    registered = [entries[one.recording.file or ""] for one in rig.values()]
    amplitudes = stored_content(results, "amplitudes").get("rows", ())
    levels, pairs = data["comparisons"], validation.pairs.to_dict("records")
    pictures = (picture_rows(state, [of[state] for of in views.values()], levels) for state in models)
    data |= {
        "schema_version": REPORT_SCHEMA,
        "status": "ok",
        "near": [*near_cage_rows(data), *near_level_rows(levels, amplitudes)],
        "pairs": pairs,
        "recordings": registered,
        "problems": list_problems(register, pairs),
        "pictures": [row for rows in pictures for row in rows],
        "runs": [run_facts(name, run) for name, run in runs.items()],
        "scene": scene_dict(runs["paper-outer"].scene) | {"geometry": vars(bearing.geometry)},
    }
    return Findings(
        data=data,
        views=views,
        datasets=tuple(dataset(name) for name in dict.fromkeys(one.dataset for one in of_rig) if name),
        results=results,
        provenance=provenance(runs.values(), {Path(one.file).name: one.sha256 for one in registered}),
    )


def require_states(found: Collection[Fault], failed: Iterable[Row]) -> None:
    """Raise `DataError` if a bearing state of the paper is not in `found`; its message lists the `failed` pairs."""
    if missing := [state.label for state in PAPER_STATES if state not in found]:
        unusable = "".join(f"\npair {one['pair']}: {one['reason']}" for one in failed)
        raise DataError(
            f"no recording of the rig can be read for: {', '.join(missing)}. srbval is shipped with recordings "
            f"of each state: reinstall it, and list damaged files with `srbval data verify`.{unusable}"
        )


def select_simulated(registered: Iterable[RegisteredRecording], stored: Mapping[str, Any]) -> list[RegisteredRecording]:
    """Select recordings at the speeds of the runs in `stored` (all recordings, if it has no runs)."""
    speeds = {one["nominal_rpm"] for variant in stored.get("variants", ()) for one in variant["records"]}
    return [one for one in registered if not speeds or one.nominal_rpm in speeds]


def select_at_paper_load(registered: Iterable[RegisteredRecording]) -> list[RegisteredRecording]:
    """Select recordings without axial load, and with the radial load of the paper's Table 6."""
    radial_kn = table6()[Fault.OUTER].radial_kn
    return [one for one in registered if one.radial_kn == radial_kn and not one.axial_kn]


def choose_speed(read: Mapping[float, Mapping[Fault, PairReading]]) -> Mapping[Fault, PairReading]:
    """Choose the speed at which most states were recorded; of several, the nearest to the paper's motor speed."""
    paper_rpm = table6()[Fault.OUTER].motor_rpm or 0.0
    states = {rpm: sum(state in of_speed for state in PAPER_STATES) for rpm, of_speed in read.items()}
    return read[max(states, key=lambda rpm: (states[rpm], -abs(rpm - paper_rpm)))] if states else {}


def read_cage_ratios(
    of_rig: Iterable[RegisteredRecording], stored: Mapping[str, Any], bearing: Bearing
) -> Sequence[CageReading]:
    """Read the cage ratios of the rig's recordings at the speeds of the `stored` runs, or take them from the cache."""
    used = [load_entry(one) for one in select_simulated(of_rig, stored)]
    content = content_sha256(used, bearing)
    readings = CAGE_STORE.load(content, lambda rows: tuple(build(CageReading, row, "reading") for row in rows))
    if readings is None:
        readings = cage_readings(used, bearing)
        CAGE_STORE.save(content, readings)
    return readings


def cage_rows(readings: Sequence[CageReading], stored: Mapping[str, Any], kinematic: float) -> dict[str, Any]:
    """Compute the keys of ``report.json`` on the cage ratio from the rig's `readings` and the runs in `stored`."""
    means = cage_means(readings)
    rows = verdicts(readings, means, stored)
    return {
        "headline": {"holds": none_missed(rows), "verdicts": rows},
        "verdicts": rows,
        "cage_readings": readings,
        "cage_ratios": list(cage_ratio_rows(readings, means, stored, kinematic)),
        "trend": trend_row(means, rows),
    }


def line_rows(
    validation: Validation,
    runs: Mapping[str, Run],
    model_runs: Mapping[Fault, Run],
    paper: Mapping[Fault, Analysis],
    rig: Mapping[Fault, Analysis],
    stored: Mapping[str, Any],
) -> dict[str, Any]:
    """Compute the keys of ``report.json`` on lines and levels, and the biases of all recordings of the rig.

    `runs` are all runs by name, `model_runs` those at the speeds of the recordings analysed in `rig`; `paper` are the
    analysed runs at the paper's speed.
    """
    every = select_comparisons(validation.comparisons)
    shown = {one.recording.file or one.recording.name for one in rig.values()}
    of_shown = (row for row in validation.comparisons if row["record"] in shown)
    measured = [
        row | rig_scene_line(row["defect"], rig[row["defect"]], stored) for row in measured_rows(of_shown, model_runs)
    ]
    published = list(published_rows(table6(), paper, runs))
    keys = dict.fromkeys(key for one in (*published, *measured) for key in one)
    return {
        "table6": [keys | row for row in (*published, *measured)],  # a missing value is None
        "closure": tuple(check_table6_sums(published, measured, validation.case.known_bearing.rolling_elements)),
        "comparisons": records(every[every["record"].isin(shown)]),
        "bias": list(biases(every.assign(used_for="withheld"))),
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


def near_cage_rows(data: Mapping[str, Any]) -> list[Row]:
    """List the rig's cage ratios and their change with speed, with the model's errors; for `data` see `cage_rows`."""
    change = data["trend"]
    rig = {f"{one['nominal_rpm']:g} rpm": one for one in data["cage_ratios"] if one["of"] == "mean"}
    known = {name: (one["ratio"], (one["high"] - one["low"]) / 2, "") for name, one in rig.items()}
    known[change["endpoint"]] = change["rig_pct"], change["rig_ci95_pct"], "%"
    rows = dict[str, Row]()
    for one in data["verdicts"]:
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
