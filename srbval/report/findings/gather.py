"""Gather everything the report shows: run, read, analyse and compare, each with its own progress."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, RACE_DEFECTS, Bearing, Fault, load_bearing
from srbval.comparison.bias import biases
from srbval.comparison.counterpart import (
    PAPER_STATES,
    AnalysedRun,
    SimulationCase,
    paper_cases,
    run_cases,
    run_counterpart,
)
from srbval.comparison.effects import Sensitivity, sensitivity_of
from srbval.comparison.matrix import Matrix, Point, build_matrix, point_of
from srbval.comparison.other_rigs import OtherRecord
from srbval.comparison.speed_and_slip import matrix_rows, published_speeds, table6_rows
from srbval.comparison.table6 import Table6, measured_rows, published_rows, sum_rules, table6
from srbval.errors import ConfigurationError, NumericsError
from srbval.models.kernel_cache import is_compiled, precompile
from srbval.models.run import Run
from srbval.models.run_file import scene_dict
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.shown_record import shown_record
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.datasets.description import DatasetDescription, dataset
from srbval.recordings.registry import RegisteredRecording, listing, rig_recordings
from srbval.recordings.synthetic_record import write_synthetic_record
from srbval.report.findings.bands import RecordKurtogram, cross_bands, record_kurtogram
from srbval.report.findings.bearing_views import bearing_views, load_path, load_zone_case, point_passing
from srbval.report.findings.findings import Evidence
from srbval.report.findings.harmonics import harmonic_patterns, pattern_cases
from srbval.report.findings.impulse_trains import impulse_trains, train_cases
from srbval.report.findings.other_rigs_in_background import BackgroundReading
from srbval.report.findings.provenance import provenance, run_facts
from srbval.report.findings.shown_records import envelope_scalogram, sideband_shares
from srbval.report.findings.speeds import published_speed_rows, single_speed
from srbval.report.findings.stored import shown_ladder
from srbval.report.pages import Page, results_of

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
) -> Evidence:
    """Run the cases and analyse everything; the rig's recordings are those registered.

    `seconds` is the recorded duration of the paper's three runs, `jobs` the runs and records at a time (default: one
    per core), `pages` what the report shows of stored results; `stand_in_folder` receives the stand-ins' files, where
    any are needed. Raises what simulating and loading
    raise; a failed run is a `NumericsError` that names it.
    """
    if seconds < SHORTEST_S:
        raise ConfigurationError(
            f"{seconds:g} s of simulation are too short to tell fault lines from shaft harmonics; use {SHORTEST_S:g} s "
            "or more."
        )
    gathering = _Gathering(load_bearing(DEFAULT_BEARING), table6(), jobs, progress)
    return gathering.evidence(seconds, stand_in_folder, pages)


@dataclass(frozen=True)
class _Simulated:
    """The runs that no recording asks for, and what they say of numerics and open inputs."""

    cases: tuple[SimulationCase, ...]
    runs: Mapping[str, Run]
    paper: Mapping[Fault, Analysis]


@dataclass(frozen=True)
class _RigSide:
    """The records of the rig that figures show, the model's runs at their speeds, stand-ins where there are none."""

    registered: tuple[RegisteredRecording, ...]
    measured: Mapping[Fault, Analysis]
    rig: Mapping[Fault, Analysis]
    models: Mapping[Fault, AnalysedRun]


@dataclass(frozen=True)
class _Gathering:
    """One gathering under way."""

    bearing: Bearing
    printed: Table6
    jobs: int | None
    progress: Progress

    def evidence(self, seconds: float, stand_in_folder: Path, pages: Iterable[Page]) -> Evidence:
        """All of it, in the order in which one thing needs another."""
        results = results_of(pages, *RESULTS)
        with stage(self.progress, "Look up the registered recordings"):
            register = listing(or_none=True)
            of_rig = rig_recordings(register.recordings)
            chosen = choose_rig_recordings(self.printed, of_rig)
            others = BackgroundReading(register.recordings, jobs=self.jobs)
        simulated = self._simulate(seconds)
        known = sensitivity_of(results.content("sensitivity"))
        keep = {point for entry in chosen.values() if (point := point_of(entry)) is not None}
        matrix = self._matrix(of_rig, keep, known)
        rig = self._rig_side(chosen, matrix, stand_in_folder)
        model_at_rig = dict(simulated.paper) | {state: side.analysis for state, side in rig.models.items()}
        shown_cases = (*simulated.cases, *(side.case for side in rig.models.values()))
        runs = dict(simulated.runs) | {side.case.id: side.run for side in rig.models.values()}
        with stage(self.progress, "Prepare the records that figures show"):
            sides = {"model": model_at_rig, "rig": rig.rig, "paper": simulated.paper if rig.measured else {}}
            shown = {name: {s: shown_record(a) for s, a in side.items()} for name, side in sides.items()}
            scalograms = {
                name: {s: envelope_scalogram(record) for s, record in shown[name].items()} for name in ("model", "rig")
            }
        with stage(self.progress, "Wait for the recordings of other rigs"):
            other_rigs = others.records()
        scene, geometry = runs["paper-outer"].scene, self.bearing.geometry
        assert geometry is not None, "the report's bearing is one the model can run"
        trains, fits = impulse_trains(runs, self.bearing)
        return Evidence(
            bearing=self.bearing,
            printed=self.printed,
            runs=runs,
            run_facts=tuple(run_facts(case, runs[case.id]) for case in shown_cases),
            scene_values=scene_dict(scene) | {"geometry": vars(geometry)},
            paper=simulated.paper,
            model_at_rig=model_at_rig,
            rig=rig.rig,
            shown=shown,
            scalograms=scalograms,
            sidebands={name: sideband_shares(sides[name][Fault.INNER]) for name in ("model", "rig")},
            views=bearing_views(scene, geometry, runs["load-zone"]),
            load_path=load_path(runs["paper-healthy"]),
            point_passing=point_passing(runs["paper-healthy"]),
            patterns=harmonic_patterns(runs, self.progress),
            trains=trains,
            fits={fit: (record, envelope_scalogram(record)) for fit, record in fits.items()},
            kurtograms=self._kurtograms(model_at_rig, rig.rig),
            crossed=cross_bands(model_at_rig, rig.rig),
            rows=(
                *published_rows(self.printed, simulated.paper, runs),
                *measured_rows(
                    rig.measured,
                    {s: side.run for s, side in rig.models.items()},
                    [row for cell in matrix.cells if cell.point in matrix.sides for row in cell.comparisons],
                ),
            ),
            sums=tuple(sum_rules(self.printed, simulated.paper, runs, rig.measured)),
            known=known,
            registered=rig.registered,
            register=register,
            matrix=matrix,
            bias=biases(matrix.comparisons, used_for="withheld"),
            other_rigs=other_rigs,
            slips=(*matrix_rows(matrix.cells, self.bearing), *table6_rows(self.printed, self.bearing)),
            single_speed=single_speed(self.printed, self.bearing),
            published_speeds=published_speed_rows(),
            speed_source=published_speeds(),
            datasets=_datasets(rig.registered, other_rigs),
            results=results,
            ladder=shown_ladder(),
            rig_ladder=shown_ladder("rig"),
            provenance=provenance(runs.values(), rig.registered),
        )

    def _simulate(self, seconds: float) -> _Simulated:
        paper = paper_cases(seconds)
        outer = next(case for case in paper if case.state is Fault.OUTER)
        cases = (*paper, load_zone_case(outer.scene), *pattern_cases(), *train_cases())
        missing = [m for m in dict.fromkeys(case.scene.model for case in cases) if not is_compiled(m)]
        if missing:
            with stage(self.progress, f"Compile the models ({', '.join(missing)}), once after installation"):
                precompile(*missing, jobs=self.jobs)
        runs = run_cases(cases, jobs=self.jobs, progress=self.progress)
        with stage(self.progress, "Analyse the paper's runs"):
            analyses = {
                state: analyse(recording_from_run(runs[f"paper-{state}"]), bearing=self.bearing)
                for state in PAPER_STATES
            }
        return _Simulated(
            cases=cases,
            runs=runs,
            paper=analyses,
        )

    def _matrix(self, registered: Sequence[RegisteredRecording], keep: set[Point], known: Sensitivity) -> Matrix:
        with stage(self.progress, "Fill the validation matrix: the model at every record's speed and load"):
            return build_matrix(
                registered,
                bearing=self.bearing,
                counterpart=lambda rig, pool: run_counterpart(rig, pool=pool, progress=self.progress),
                sensitivity=known,
                keep_sides_of=keep,
                jobs=self.jobs,
            )

    def _rig_side(self, chosen: Mapping[Fault, RegisteredRecording], matrix: Matrix, folder: Path) -> _RigSide:
        points = {state: point_of(entry) for state, entry in chosen.items()}
        sides = {state: matrix.sides[p] for state, p in points.items() if p is not None and p in matrix.sides}
        measured = {state: rig for state, (rig, _) in sides.items()}
        with stage(self.progress, "Read the stand-ins"):
            stand_ins = _stand_ins(set(PAPER_STATES) - set(measured), self.printed, folder)
            made = {state: analyse(recording, bearing=self.bearing) for state, recording in stand_ins.items()}
        return _RigSide(
            registered=tuple(chosen[state] for state in sides),
            measured=measured,
            rig={state: (measured | made)[state] for state in PAPER_STATES},
            models={state: _model_of(state, model) for state, (_, model) in sides.items()},
        )

    def _kurtograms(
        self, model: Mapping[Fault, Analysis], rig: Mapping[Fault, Analysis]
    ) -> tuple[RecordKurtogram, ...]:
        """Model and rig, outer race and inner race."""
        wanted = [(fault, side[fault]) for fault in RACE_DEFECTS for side in (model, rig)]
        found = []
        for number, (fault, analysis) in enumerate(wanted):
            self.progress("Look for impulsive bands", number / len(wanted))
            assert fault.line is not None, "the defects of races have lines"
            found.append(record_kurtogram(analysis, fault.line))
        self.progress("Look for impulsive bands", 1.0)
        return tuple(found)


def _model_of(state: Fault, model: AnalysedRun | str) -> AnalysedRun:
    """Figures cannot do without the model's run."""
    if isinstance(model, str):
        raise NumericsError(f"the model's run at the speed of the {state} recording failed: {model}")
    return model


def _datasets(
    registered: Iterable[RegisteredRecording], other_rigs: Iterable[OtherRecord]
) -> dict[str, DatasetDescription]:
    names = [*(entry.dataset for entry in registered), *(record.dataset for record in other_rigs)]
    return {name: dataset(name) for name in names if name}


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
