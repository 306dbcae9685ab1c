"""The findings, all that the report shows, as frozen data: run, read, analyse and compare, then nothing is computed."""

import dataclasses
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Bearing, Fault, load_bearing
from srbval.comparison.bias import biases
from srbval.comparison.budget import STATED
from srbval.comparison.cage_means import CageMeans, cage_means
from srbval.comparison.cage_readings import CageReading, cage_readings
from srbval.comparison.comparison import deviation_pct
from srbval.comparison.counterpart import (
    COUNTERPARTS,
    PAPER_STATES,
    AnalysedRun,
    paper_cases,
    run_cases,
    run_counterpart,
    stored_starts,
)
from srbval.comparison.effects import Sensitivity, sensitivity_of
from srbval.comparison.matrix import Matrix, Sides, build_matrix, point_of
from srbval.comparison.speed_and_slip import matrix_rows, one_speed_reading, published_speeds, table6_rows
from srbval.comparison.table6 import Table6, measured_rows, published_rows, sum_rules, table6
from srbval.comparison.verdicts import Headline, Row, Verdict, joint_tests, second_looks, trend_pct, verdicts
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.models.run import Run
from srbval.models.run_file import scene_dict
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import recording_from_run
from srbval.recordings.datasets.description import DatasetDescription, PublishedSpeeds, dataset
from srbval.recordings.registry import RegisteredRecording, RegisterListing, listing, load_entry, rig_recordings
from srbval.report.findings.load_zone import LoadZone, load_sharing, load_zone, load_zone_case, point_passing
from srbval.report.findings.provenance import TIMED, provenance, run_facts
from srbval.report.findings.records import (
    RecordKurtogram,
    RecordView,
    envelope_scalogram,
    record_kurtogram,
    record_view,
    sideband_shares,
)
from srbval.report.pages import Page, StoredResults, results_of
from srbval.signal import NORMAL_95, Scalogram

SCHEMA_VERSION = 1
SHORTEST_S = 1.0  # below this the envelope spectrum cannot separate the lines from shaft harmonics
# Stored ones that uncertainties, verdicts and the model's values are made of.
RESULTS = ("sensitivity", "cage_draws", "verdict_power", COUNTERPARTS)
Side = Mapping[Fault, Analysis]
MIDDLE = (0.025, 0.5, 0.975)  # of a distribution: its median and the ends of its 95 % interval


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """What the report is made of: `data`, the content of ``report.json``, and what figures draw and sections word.

    `matrix` and what `data` says of slip take in every registered recording of the rig; the rest shows the model and
    the rig at one of the matrix's speeds. Sides are ``paper`` (the model at 710 rpm), ``model`` (at each rig
    recording's own speed) and ``rig`` in `analyses`, the last two in `views` and `scalograms`. `runs` are those shown,
    by the id of their case, not those of every other record of the matrix; `run_facts` says how each went. `datasets`
    are those of the rig's recordings.
    """

    data: Mapping[str, Any]
    bearing: Bearing
    printed: Table6
    runs: Mapping[str, Run]
    run_facts: tuple[Mapping[str, Any], ...]
    analyses: Mapping[str, Side]
    views: Mapping[str, Mapping[Fault, RecordView]]
    scalograms: Mapping[str, Mapping[Fault, Scalogram]]
    load_zone: LoadZone
    kurtograms: tuple[RecordKurtogram, ...]
    known: Sensitivity
    matrix: Matrix
    cage_readings: tuple[CageReading, ...]
    datasets: tuple[DatasetDescription, ...]
    speed_source: PublishedSpeeds
    results: StoredResults
    provenance: Mapping[str, Any]

    @property
    def headline(self) -> Headline:
        """How far the model's cage ratio is from that of the rig's records."""
        found: Headline = self.data["headline"]
        return found


def gather(
    *, seconds: float, pages: Iterable[Page] = (), jobs: int | None = None, progress: Progress = silent
) -> Findings:
    """Run the cases and analyse everything; the rig's recordings are those registered.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs and records at a time (default: one
    per core), `pages` what the report shows of stored results. Raises what simulating and loading raise; a failed run
    is a `NumericsError` that names it, a state without a recording that can be read a `DataError`.
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
    runs, facts = _simulate(seconds, jobs, progress)
    starts = stored_starts(results.get(COUNTERPARTS))
    known = sensitivity_of(results.content("sensitivity"))
    points = {state: point for state, entry in chosen.items() if (point := point_of(entry)) is not None}
    with stage(progress, "Fill the validation matrix: the model at every record's speed and load"):
        matrix = build_matrix(
            of_rig, bearing=bearing, sensitivity=known, keep_sides_of=set(points.values()), jobs=jobs,
            counterpart=lambda rig, pool: run_counterpart(rig, pool=pool, stored=starts, progress=progress),
        )  # fmt: skip
    with stage(progress, "Read the cage ratio of every record"):
        readings = cage_readings(
            [load_entry(one) for one in at_drawn_points(of_rig, printed, results.content("cage_draws"))], bearing
        )
    with stage(progress, "Analyse the paper's runs"):
        paper = {s: analyse(recording_from_run(runs[f"paper-{s}"]), bearing=bearing) for s in PAPER_STATES}
    sides = {state: matrix.sides[point] for state, point in points.items() if point in matrix.sides}
    models = _models(sides, matrix)
    analyses = {
        "paper": paper, "model": {state: side.analysis for state, side in models.items()},
        "rig": {state: rig for state, (rig, _) in sides.items()},
    }  # fmt: skip
    runs |= {side.case.id: side.run for side in models.values()}
    facts += [run_facts(side.case, side.run) for side in models.values()]
    with stage(progress, "Prepare the records that figures show"):
        views = {name: {s: record_view(one) for s, one in analyses[name].items()} for name in ("model", "rig")}
    with stage(progress, "Look for impulsive bands"):
        kurtograms = tuple(record_kurtogram(analyses[side][s]) for s in RACE_DEFECTS for side in ("model", "rig"))
    scene, geometry = runs["paper-outer"].scene, bearing.geometry
    assert geometry is not None, "the report's bearing is one the model can run"
    registered = [chosen[state] for state in sides]
    found = Findings(
        data={}, bearing=bearing, printed=printed, runs=runs, run_facts=tuple(facts), analyses=analyses, views=views,
        scalograms={name: {s: envelope_scalogram(one) for s, one in side.items()} for name, side in views.items()},
        load_zone=load_zone(runs["load-zone"], geometry),
        kurtograms=kurtograms, known=known, matrix=matrix,
        cage_readings=readings,
        datasets=tuple(dataset(name) for name in dict.fromkeys(one.dataset for one in of_rig) if name),
        speed_source=published_speeds(),
        results=results, provenance=provenance(runs.values(), registered),
    )  # fmt: skip
    data = _compared(found, models, register, registered) | {
        "scene": scene_dict(scene) | {"geometry": vars(geometry)},
        "cautions": cautions(matrix.cells),
    }
    return dataclasses.replace(found, data=data)


def _compared(
    found: Findings, models: Mapping[Fault, AnalysedRun], register: RegisterListing,
    registered: Sequence[RegisteredRecording],
) -> dict[str, Any]:  # fmt: skip
    """The part of ``report.json`` that follows from the findings, and what it says of the register."""
    printed, bearing, matrix, runs = found.printed, found.bearing, found.matrix, found.runs
    comparisons = [row for cell in matrix.cells if cell.point in matrix.sides for row in cell.comparisons]
    model_runs = {state: side.run for state, side in models.items()}
    paper, rig = (found.analyses[side] for side in ("paper", "rig"))
    rpm, cage_pct = one_speed_reading(printed, bearing)
    content = found.results.content
    return {
        "schema_version": SCHEMA_VERSION,
        "status": "ok",
        "headline": Headline(verdicts=(rows := verdicts(found.cage_readings, content("cage_draws")))),
        "verdicts": rows,
        **cage_data(found.cage_readings, content("cage_draws"), rows, bearing.orders.ftf),
        "table6": (*published_rows(printed, paper, runs), *measured_rows(rig, model_runs, comparisons)),
        "closure": tuple(sum_rules(printed, paper, runs, rig)),
        "comparisons": comparisons,
        "matrix": matrix.cells,
        "speed_and_slip": (*matrix_rows(matrix.cells, bearing), *table6_rows(printed, bearing)),
        "published_speeds": list(published_speed_rows()),
        "single_speed": {"shaft_rpm": rpm, "cage_pct": cage_pct},
        "recordings": tuple(registered),
        "recordings_not_used": [
            {"file": Path(r.file).name, "status": r.status.value, "reason": r.reason or ""} for r in register.problems
        ],
        "register_unreadable": register.unreadable or None,
        "bias": biases(matrix.comparisons, used_for="withheld"),
        "sensitivity": found.known.defects,
        "sidebands": {name: sideband_shares(found.analyses[name][Fault.INNER]) for name in ("model", "rig")},
        "load_zone": found.load_zone,
        "load_path": load_sharing(runs["paper-healthy"]),
        "point_passing": point_passing(runs["paper-healthy"]),
        "kurtograms": found.kurtograms,
        "kept_results": {name: result.origin for name, result in found.results.items()},
        "runs": [{key: value for key, value in fact.items() if key != TIMED} for fact in found.run_facts],
    }  # fmt: skip


def _simulate(seconds: float, jobs: int | None, progress: Progress) -> tuple[dict[str, Run], list[dict[str, Any]]]:
    """The runs that no recording asks for, by their case, and how each went."""
    paper = paper_cases(seconds)
    cases = [*paper, load_zone_case(next(case.scene for case in paper if case.state is Fault.OUTER))]
    runs = run_cases(cases, jobs=jobs, progress=progress)
    return dict(runs), [run_facts(case, runs[case.id]) for case in cases]


def _models(found: Mapping[Fault, Sides], matrix: Matrix) -> dict[Fault, AnalysedRun]:
    """The run at the speed of the rig's recording of each state; figures cannot do without a recording or a run."""
    if missing := [state.label for state in PAPER_STATES if state not in found]:
        unusable = "".join(f"\n{file}: {why}" for file, why in matrix.unusable)
        raise DataError(
            f"no recording of the rig can be read for: {', '.join(missing)}. srbval comes with one of each state: "
            f"install it again, and see what `srbval data verify` names.{unusable}"
        )
    models = dict[Fault, AnalysedRun]()
    for state, (_, model) in found.items():
        if isinstance(model, str):
            raise NumericsError(f"the model's run at the speed of the {state} recording failed: {model}")
        models[state] = model
    return models


def cautions(records: Iterable[Any]) -> list[dict[str, str]]:
    """What may make the numbers of a recording wrong that this report uses, each file and caution once."""
    once = dict.fromkeys((Path(record.file).name, caution) for record in records for caution in record.cautions)
    return [{"file": file, "caution": caution} for file, caution in once]


def published_speed_rows() -> Iterator[dict[str, Any]]:
    """Mean tachometer speed of each state's published record at a nominal speed, and from the outer-race record's."""
    means = {(mean.state, mean.nominal_rpm): mean.mean_rpm for mean in published_speeds().means}
    for state, rpm in sorted(means, key=lambda key: (list(Fault).index(key[0]), key[1])):
        mean = means[state, rpm]
        from_outer_pct = deviation_pct(mean, means[Fault.OUTER, rpm])
        yield {"state": state, "nominal_rpm": rpm, "mean_rpm": mean, "from_outer_pct": from_outer_pct}


def at_drawn_points(
    registered: Iterable[RegisteredRecording], printed: Table6, stored: Mapping[str, Any]
) -> list[RegisteredRecording]:
    """Those at the paper's load, no axial one, and a speed of the model's stored draws; any speed without draws."""
    speeds = {one["nominal_rpm"] for variant in stored.get("variants", ()) for one in variant["records"]}
    at_load = [one for one in registered if one.radial_kn == printed.radial_kn and not one.axial_kn]
    return [one for one in at_load if not speeds or one.nominal_rpm in speeds]


def choose_rig_recordings(
    printed: Table6, registered: Iterable[RegisteredRecording]
) -> dict[Fault, RegisteredRecording]:
    """Those of the rig's recordings to hold the model against: one nominal speed, the paper's load, no axial load.

    The speed with most of the three states wins, then the one nearest to the paper's 727 rpm; of several records of
    a state the longest, as in the matrix.
    """
    by_speed: dict[float, dict[Fault, RegisteredRecording]] = {}
    for entry in sorted(registered, key=lambda entry: -(entry.seconds or 0)):
        at_load = entry.radial_kn == printed.radial_kn and not entry.axial_kn
        if at_load and entry.nominal_rpm is not None and (entry.seconds or 0) >= SHORTEST_S:
            by_state = by_speed.setdefault(entry.nominal_rpm, {})
            if entry.state in PAPER_STATES and entry.state is not None:
                by_state.setdefault(entry.state, entry)
    best = max(by_speed, key=lambda rpm: (len(by_speed[rpm]), -abs(rpm - printed.motor_rpm)), default=None)
    chosen = {} if best is None else by_speed[best]
    return {state: chosen[state] for state in PAPER_STATES if state in chosen}


def cage_ratio_rows(
    readings: Sequence[CageReading], means: CageMeans, stored: Mapping[str, Any], kinematic: float
) -> Iterator[Row]:
    """By nominal speed: each record, their mean, each scene as it is stated, kinematics; see `cage_ratio_plot`."""
    for place, rpm in enumerate(means.rpm):
        for one in (one for one in readings if one.nominal_rpm == rpm):
            half = NORMAL_95 * float(np.hypot(one.reading_u, one.speed_u))
            yield _row("record", rpm, (one.ratio - half, one.ratio, one.ratio + half), one.state.code)
        yield _row("mean", rpm, np.quantile(means.draws[:, place], MIDDLE))
        for variant in stored.get("variants", ()):
            own = [one["drawn"] for one in variant["records"] if one["nominal_rpm"] == rpm]
            if own and variant["form"] == STATED:
                yield _row(variant["scene"], rpm, np.quantile(np.mean(own, axis=0), MIDDLE))
        yield _row("kinematics", rpm, (kinematic,) * 3)


def _row(of: str, rpm: float, interval: Iterable[float], state: str = "") -> Row:
    low, ratio, high = map(float, interval)
    return {"of": of, "state": state, "nominal_rpm": rpm, "ratio": ratio, "low": low, "high": high}


def trend(means: CageMeans, rows: Iterable[Verdict]) -> Row:
    """How much the cage ratio changes from the fastest speed to the slowest [%]: rig, and the scene ``rig``.

    The model's values are None without its stored draws.
    """
    rig, ci95 = trend_pct(means)
    name = f"{means.rpm[0]:g} less {means.rpm[-1]:g} rpm"
    own = next((one for one in rows if (one.scene, one.form, one.endpoint) == ("rig", STATED, name)), None)
    return {
        "endpoint": name, "records": list(means.records), "rig_pct": rig, "rig_ci95_pct": ci95,
        "between_records_pct": 100 * means.between_u / means.means[-1],
        "between_records_ci95_pct": [100 * end / means.means[-1] for end in means.between_ci95],
        "model_pct": own and rig + own.error_pct, "u_pct": own and own.u_pct, "verdict": own and own.verdict,
    }  # fmt: skip


def cage_data(
    readings: Sequence[CageReading], stored: Mapping[str, Any], rows: Sequence[Verdict], kinematic: float
) -> dict[str, Any]:
    """The keys of ``report.json`` that follow from the records' readings and the model's `stored` draws."""
    means = cage_means(readings)
    return {
        "cage_readings": readings,
        "cage_ratios": list(cage_ratio_rows(readings, means, stored, kinematic)),
        "trend": trend(means, rows),
        "joint_tests": list(joint_tests(readings, stored)),
        "second_look": list(second_looks(readings, stored)),
    }
