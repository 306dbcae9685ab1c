"""Gather everything the report shows: run, read, analyse and compare, each with its own progress."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Bearing, Fault, load_bearing
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.counterpart import (
    PAPER_STATES,
    AnalysedRun,
    SimulationCase,
    paper_cases,
    run_cases,
    run_counterpart,
)
from srbval.comparison.effects import Sensitivity, sensitivity_of
from srbval.comparison.headline import biases, headline
from srbval.comparison.matrix import Matrix, build_matrix, point_of
from srbval.comparison.speed_and_slip import matrix_rows, one_speed_reading, published_speeds, table6_rows
from srbval.comparison.table6 import Table6, measured_rows, published_rows, sum_rules, table6
from srbval.errors import ConfigurationError, NumericsError
from srbval.models.jit import is_compiled, precompile
from srbval.models.run import Run
from srbval.models.run_file import scene_dict
from srbval.plan.calibrated import shipped_calibration
from srbval.plan.table import summary
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.datasets.description import dataset
from srbval.recordings.registry import RegisteredRecording, RegisterListing, listing, rig_recordings
from srbval.recordings.synthetic_record import write_synthetic_record
from srbval.report.findings.bearing_views import bearing_views, load_sharing, load_zone_case, point_passing
from srbval.report.findings.findings import Findings
from srbval.report.findings.other_rigs_in_background import BackgroundReading
from srbval.report.findings.patterns import clearness, harmonic_patterns, impulse_trains, pattern_cases
from srbval.report.findings.provenance import TIMED, provenance, run_facts
from srbval.report.findings.records import (
    RecordKurtogram,
    cross_bands,
    envelope_scalogram,
    record_kurtogram,
    record_view,
    sideband_shares,
)
from srbval.report.pages import Page, StoredResults, results_of
from srbval.scene import LoadPath, RollerFit

SCHEMA_VERSION = 1
SHORTEST_S = 1.0  # below this the envelope spectrum cannot separate the lines from shaft harmonics
STAND_IN_SECONDS = 2.0
RESULTS = ("sensitivity", "verdict_scan", "rig_inputs")  # stored ones that uncertainties and headline are made of


def gather(
    *,
    seconds: float,
    stand_in_folder: Path,
    pages: Iterable[Page] = (),
    jobs: int | None = None,
    progress: Progress = silent,
) -> Findings:
    """Run the cases and analyse everything; the rig's recordings are those registered.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs and records at a time (default: one
    per core), `pages` what the report shows of stored results; `stand_in_folder` receives the stand-ins' files, where
    any are needed. Raises what simulating and loading raise; a failed run is a `NumericsError` that names it.
    """
    if seconds < SHORTEST_S:
        raise ConfigurationError(
            f"{seconds:g} s of simulation are too short to tell fault lines from shaft harmonics; use {SHORTEST_S:g} s "
            "or more."
        )
    bearing, printed, results = load_bearing(DEFAULT_BEARING), table6(), results_of(pages, *RESULTS)
    with stage(progress, "Look up the registered recordings"):
        register = listing(or_none=True)
        of_rig = rig_recordings(register.recordings)
        chosen = choose_rig_recordings(printed, of_rig)
        others = BackgroundReading(register.recordings, jobs=jobs)
    cases, runs = _simulate(seconds, jobs, progress)
    with stage(progress, "Analyse the paper's runs"):
        paper = {s: analyse(recording_from_run(runs[f"paper-{s}"]), bearing=bearing) for s in PAPER_STATES}
    known = sensitivity_of(results.content("sensitivity"))
    points = {state: point for state, entry in chosen.items() if (point := point_of(entry)) is not None}
    with stage(progress, "Fill the validation matrix: the model at every record's speed and load"):
        matrix = build_matrix(
            of_rig, bearing=bearing, sensitivity=known, keep_sides_of=set(points.values()), jobs=jobs,
            counterpart=lambda rig, pool: run_counterpart(rig, pool=pool, progress=progress),
        )  # fmt: skip
    sides = {state: matrix.sides[point] for state, point in points.items() if point in matrix.sides}
    measured = {state: rig for state, (rig, _) in sides.items()}
    with stage(progress, "Read the stand-ins"):
        stand_ins = _stand_ins(set(PAPER_STATES) - set(measured), printed, stand_in_folder)
        found = measured | {state: analyse(record, bearing=bearing) for state, record in stand_ins.items()}
    models = {state: _model_of(state, model) for state, (_, model) in sides.items()}
    shown_cases = (*cases, *(side.case for side in models.values()))
    runs |= {side.case.id: side.run for side in models.values()}
    return _findings(
        _Gathered(
            bearing=bearing, printed=printed, results=results, register=register, known=known, matrix=matrix,
            registered=tuple(chosen[state] for state in sides), measured=measured, models=models, runs=runs,
            facts=tuple(run_facts(case, runs[case.id]) for case in shown_cases),
            analyses={
                "paper": paper, "model": paper | {state: side.analysis for state, side in models.items()},
                "rig": {state: found[state] for state in PAPER_STATES},
            },
        ),
        others,
        progress,
    )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class _Gathered:
    """What was looked up, run and analysed, before anything is made of it; see `Findings`."""

    bearing: Bearing
    printed: Table6
    results: StoredResults
    register: RegisterListing
    known: Sensitivity
    matrix: Matrix
    registered: tuple[RegisteredRecording, ...]
    measured: Mapping[Fault, Analysis]
    models: Mapping[Fault, AnalysedRun]
    runs: Mapping[str, Run]
    facts: tuple[dict[str, Any], ...]
    analyses: Mapping[str, Mapping[Fault, Analysis]]


def _findings(given: _Gathered, others: BackgroundReading, progress: Progress) -> Findings:
    runs, bearing, analyses = given.runs, given.bearing, given.analyses
    with stage(progress, "Prepare the records that figures show"):
        shown = {**analyses, "paper": analyses["paper"] if given.measured else {}}
        views = {name: {s: record_view(a) for s, a in shown[name].items()} for name in ("model", "rig", "paper")}
        scalograms = {
            name: {s: envelope_scalogram(view) for s, view in views[name].items()} for name in ("model", "rig")
        }  # fmt: skip
        trains = impulse_trains(runs, bearing)
        fits = {fit: record_view(trains[fit, LoadPath.HOUSING]) for fit in RollerFit}
    with stage(progress, "Look for missing harmonics"):
        patterns = harmonic_patterns(runs)
    kurtograms = _kurtograms(analyses["model"], analyses["rig"], progress)
    with stage(progress, "Wait for the recordings of other rigs"):
        other_rigs = others.records()
    scene, geometry = runs["paper-outer"].scene, bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    shown_bearing = bearing_views(scene, geometry, runs["load-zone"])
    ladders = {base: shipped_calibration(base) for base in ("paper", "rig")}
    data = _compared(given) | {
        "bias": biases(given.matrix.comparisons, used_for="withheld"),
        "sensitivity": given.known.defects,
        "analyses": {
            f"{name}-{state}": analysis
            for name, side in (("paper", "paper"), ("beside-rig", "model"), ("rig", "rig"))
            for state, analysis in analyses[side].items()
        },
        "sidebands": {name: sideband_shares(analyses[name][Fault.INNER]) for name in ("model", "rig")},
        "load_zone": shown_bearing.load_zone,
        "load_path": load_sharing(runs["paper-healthy"]),
        "point_passing": point_passing(runs["paper-healthy"]),
        "harmonic_patterns": patterns,
        "impulse_trains": [clearness(fit, path, analysis) for (fit, path), analysis in trains.items()],
        "kurtograms": [_kurtogram_entry(one) for one in kurtograms],
        "kept_results": {name: result.origin for name, result in given.results.items()},
        "ladder": summary(ladders["paper"]),
        "rig_ladder": summary(ladders["rig"]),
        "other_rigs": other_rigs,
        "runs": [{key: value for key, value in fact.items() if key != TIMED} for fact in given.facts],
        "scene": scene_dict(scene) | {"geometry": vars(geometry)},
        "cautions": cautions([*given.matrix.cells, *other_rigs]),
    }
    sets = (*(r.dataset for r in given.registered), *(r.dataset for r in other_rigs))
    return Findings(
        data=data, bearing=bearing, printed=given.printed, runs=runs, run_facts=given.facts, analyses=analyses,
        views=views, scalograms=scalograms, fits={fit: (view, envelope_scalogram(view)) for fit, view in fits.items()},
        bearing_views=shown_bearing, kurtograms=kurtograms, known=given.known, matrix=given.matrix,
        datasets={name: dataset(name) for name in sets if name}, speed_source=published_speeds(), ladders=ladders,
        results=given.results, provenance=provenance(runs.values(), given.registered),
    )  # fmt: skip


def _compared(given: _Gathered) -> dict[str, Any]:
    """The part of ``report.json`` on the model against the paper and the rig, and on the register."""
    printed, bearing, matrix, problems = given.printed, given.bearing, given.matrix, given.register.problems
    comparisons = [row for cell in matrix.cells if cell.point in matrix.sides for row in cell.comparisons]
    of_runs = {state: side.run for state, side in given.models.items()}
    paper, model, rig = (given.analyses[side] for side in ("paper", "model", "rig"))
    rpm, cage_pct = one_speed_reading(printed, bearing)
    content = given.results.content
    return {
        "schema_version": SCHEMA_VERSION,
        "status": "ok",
        "headline": headline(comparisons, content("rig_inputs"), content("verdict_scan")),
        "table6": (
            *published_rows(printed, paper, given.runs), *measured_rows(given.measured, of_runs, comparisons)
        ),
        "closure": tuple(sum_rules(printed, paper, given.runs, given.measured)),
        "comparisons": comparisons,
        "matrix": matrix.cells,
        "crossed_bands": cross_bands(model, rig),
        "speed_and_slip": (*matrix_rows(matrix.cells, bearing), *table6_rows(printed, bearing)),
        "published_speeds": list(published_speed_rows()),
        "single_speed": {"shaft_rpm": rpm, "cage_pct": cage_pct},
        "recordings": given.registered,
        "recordings_not_used": [
            {"file": Path(r.file).name, "status": r.status.value, "reason": r.reason or ""} for r in problems
        ],
        "register_unreadable": given.register.unreadable or None,
    }  # fmt: skip


def _simulate(seconds: float, jobs: int | None, progress: Progress) -> tuple[list[SimulationCase], dict[str, Run]]:
    """The runs that no recording asks for."""
    paper = paper_cases(seconds)
    outer = next(case for case in paper if case.state is Fault.OUTER)
    cases = [*paper, load_zone_case(outer.scene), *pattern_cases()]
    missing = [m for m in dict.fromkeys(case.scene.model for case in cases) if not is_compiled(m)]
    if missing:
        with stage(progress, f"Compile the models ({', '.join(missing)}), once after installation"):
            precompile(*missing, jobs=jobs)
    return cases, dict(run_cases(cases, jobs=jobs, progress=progress))


def _model_of(state: Fault, model: AnalysedRun | str) -> AnalysedRun:
    """Figures cannot do without the model's run."""
    if isinstance(model, str):
        raise NumericsError(f"the model's run at the speed of the {state} recording failed: {model}")
    return model


def _kurtograms(
    model: Mapping[Fault, Analysis], rig: Mapping[Fault, Analysis], progress: Progress
) -> tuple[RecordKurtogram, ...]:
    """Model and rig, outer race and inner race."""
    wanted = [(fault, side[fault]) for fault in RACE_DEFECTS for side in (model, rig)]
    found = []
    for number, (fault, analysis) in enumerate(wanted):
        progress("Look for impulsive bands", number / len(wanted))
        found.append(record_kurtogram(analysis, fault.line or ""))
    progress("Look for impulsive bands", 1.0)
    return tuple(found)


def _kurtogram_entry(record: RecordKurtogram) -> dict[str, Any]:
    recording, picture, second = record.analysis.recording, record.kurtogram, record.second_comb
    return {
        "file": recording.file,
        "origin": recording.origin,
        "state": recording.state,
        "line": record.line,
        "band_hz": record.analysis.processed.band_hz,
        "most_impulsive_hz": picture.best_hz,
        "kurtosis_less_2": float(picture.kurtosis.max()),
        "bands": picture.size,
        "second_comb": None if second is None else second.line(record.line),
    }


def cautions(records: Iterable[Any]) -> list[dict[str, str]]:
    """What may make the numbers of a recording wrong that this report uses, each file and caution once."""
    once = dict.fromkeys((Path(record.file).name, caution) for record in records for caution in record.cautions)
    return [{"file": file, "caution": caution} for file, caution in once]


def published_speed_rows() -> Iterator[dict[str, Any]]:
    """Mean tachometer speed of each state's published record at a nominal speed, and from the outer-race record's."""
    means = {(mean.state, mean.nominal_rpm): mean.mean_rpm for mean in published_speeds().means}
    for state, rpm in sorted(means, key=lambda key: (list(Fault).index(key[0]), key[1])):
        mean = means[state, rpm]
        yield {
            "state": state, "nominal_rpm": rpm, "mean_rpm": mean,
            "from_outer_pct": deviation_pct(mean, means[Fault.OUTER, rpm]),
        }  # fmt: skip


def choose_rig_recordings(
    printed: Table6, registered: Iterable[RegisteredRecording]
) -> dict[Fault, RegisteredRecording]:
    """Those of the rig's recordings to hold the model against: one nominal speed, the paper's load, no axial load.

    The speed with most of the three states wins, then the one nearest to the paper's 727 rpm; of several records of
    a state the longest, as in the matrix.
    """
    usable = [
        r
        for r in registered
        if r.radial_kn == printed.radial_kn
        and not r.axial_kn
        and r.nominal_rpm is not None
        and r.state in PAPER_STATES
        and (r.seconds or 0) >= SHORTEST_S
    ]
    by_speed: dict[float, dict[Fault, RegisteredRecording]] = {}
    for entry in sorted(usable, key=lambda entry: -(entry.seconds or 0)):
        if entry.nominal_rpm is not None and entry.state is not None:
            by_speed.setdefault(entry.nominal_rpm, {}).setdefault(entry.state, entry)
    if not by_speed:
        return {}
    best = max(by_speed, key=lambda rpm: (len(by_speed[rpm]), -abs(rpm - printed.motor_rpm)))
    return {state: by_speed[best][state] for state in PAPER_STATES if state in by_speed[best]}


def _stand_ins(states: set[Fault], printed: Table6, folder: Path) -> dict[Fault, Recording]:
    folder.mkdir(parents=True, exist_ok=True)
    made = {
        state: write_synthetic_record(
            folder / f"stand-in-{state}.h5",
            state=state,
            shaft_hz=printed.shaft_rpm / 60,
            seconds=STAND_IN_SECONDS,
            seed=i,
        )
        for i, state in enumerate(PAPER_STATES)
        if state in states
    }
    # the folder is gone by the time the report is read, and has another name each time
    return {state: replace(recording, file=f"stand-in-{state}.h5") for state, recording in made.items()}
