"""Everything the report shows, gathered once: runs, analyses, comparisons, sums, variations."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.errors import ConfigurationError, NumericsError
from srbval.evidence.other_rigs_in_background import BackgroundReading
from srbval.models.run import Run
from srbval.progress import Progress, silent, stage
from srbval.recordings import Origin, Recording, recording_from_run, write_stand_in
from srbval.recordings.registry import RegisteredRecording, listing, rig_recordings
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.comparison import Comparison
from srbval.validation.counterpart import AnalysedRun, run_counterpart
from srbval.validation.effects import NO_SENSITIVITY, Sensitivity
from srbval.validation.fill_matrix import build_matrix, point_of
from srbval.validation.matrix import Matrix
from srbval.validation.other_rigs import OtherRecord
from srbval.validation.simulation_cases import (
    PAPER_STATES,
    SimulationCase,
    Variation,
    as_sensitivity,
    paper_cases,
    run_cases,
    variation,
    variation_cases,
)
from srbval.validation.speed_and_slip import SpeedAndSlip, matrix_rows, table6_rows
from srbval.validation.sum_rule import SumRule
from srbval.validation.table6 import Table6, Table6Row, measured_rows, published_rows, sum_rules, table6

SHORTEST_S = 1.0  # below this the envelope spectrum cannot separate the lines from shaft harmonics
STAND_IN_SECONDS = 2.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """What the report is made of.

    `matrix`, `other_rigs` and `slips` take in every registered recording; the rest shows the model beside the rig at
    one of the matrix's speeds: `paper` are the model's analyses at 710 rpm; `rig` those of the rig's recordings, or of
    stand-ins where a state has none; `beside_rig` those of the model at each rig recording's own speed (at 710 rpm
    beside a stand-in). `cases` and `runs` are those shown, not those beside every other record of the matrix.
    """

    bearing: Bearing
    printed: Table6
    cases: tuple[SimulationCase, ...]
    runs: Mapping[str, Run]
    paper: Mapping[Fault, Analysis]
    beside_rig: Mapping[Fault, Analysis]
    rig: Mapping[Fault, Analysis]
    rows: tuple[Table6Row, ...]
    sums: tuple[SumRule, ...]
    variations: tuple[Variation, ...]
    known: Sensitivity
    registered: tuple[RegisteredRecording, ...]
    matrix: Matrix
    other_rigs: tuple[OtherRecord, ...]
    slips: tuple[SpeedAndSlip, ...]

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every quantity of the recordings that stand in the figures."""
        return tuple(row for cell in self.matrix.cells if cell.point in self.matrix.sides for row in cell.comparisons)

    @property
    def measured_states(self) -> tuple[Fault, ...]:
        """States for which the rig side is a measured recording."""
        return tuple(s for s in self.rig if self.rig[s].recording.origin is Origin.MEASURED)


def gather(
    *,
    seconds: float,
    stand_in_folder: Path,
    jobs: int | None = None,
    progress: Progress = silent,
    known: Sensitivity = NO_SENSITIVITY,
) -> Evidence:
    """Run the cases and analyse everything; the rig's recordings are those registered.

    `known` are the stored sensitivities, where there are any. `seconds` is the recorded duration of the paper's three
    runs; `stand_in_folder` receives the stand-ins' files, where any are needed. Raises what simulation and
    loading raise.
    """
    if seconds < SHORTEST_S:
        raise ConfigurationError(
            f"{seconds:g} s of simulation are too short to tell fault lines from shaft harmonics; use {SHORTEST_S:g} s "
            "or more."
        )
    bearing = load_bearing(DEFAULT_BEARING)
    printed = table6()
    with stage(progress, "Look at the registered recordings"):
        registered = choose_rig_recordings(printed)
    shown = {state: point for state, entry in registered.items() if (point := point_of(entry)) is not None}
    cases = [*paper_cases(seconds), *variation_cases(seconds)]
    runs = run_cases(cases, jobs=jobs, progress=progress)
    variations = tuple(
        variation(c, runs[c.id], runs[f"paper-{c.state}"]) for c in cases if not c.id.startswith("paper-")
    )
    if not known.effects:
        known = as_sensitivity(variations, runs["paper-outer"])
    others = BackgroundReading(listing().recordings, jobs=jobs)
    with stage(progress, "Fill the validation matrix, with a model run for every record"):
        matrix = build_matrix(
            rig_recordings(), bearing=bearing,
            counterpart=lambda rig: run_counterpart(rig, progress=progress), sensitivity=known,
            keep_sides_of=set(shown.values()), jobs=jobs,
        )  # fmt: skip
    measured = {state: matrix.sides[point] for state, point in shown.items() if point in matrix.sides}
    beside_run = {state: _model_of(state, sides.model) for state, sides in measured.items()}
    measured_side = {state: sides.rig for state, sides in measured.items()}
    stand_ins = _stand_ins(set(PAPER_STATES) - set(measured), printed, stand_in_folder)
    rig_side = measured_side | {state: analyse(r, bearing=bearing) for state, r in stand_ins.items()}
    paper = {s: analyse(recording_from_run(runs[f"paper-{s}"]), bearing=bearing) for s in PAPER_STATES}
    beside = paper | {state: side.analysis for state, side in beside_run.items()}
    rows = (
        *published_rows(printed, paper, runs),
        *measured_rows(measured_side, {s: side.run for s, side in beside_run.items()}, known.effects),
    )
    return Evidence(
        bearing=bearing,
        printed=printed,
        cases=(*cases, *(side.case for side in beside_run.values())),
        runs=runs | {side.case.id: side.run for side in beside_run.values()},
        paper=paper,
        beside_rig=beside,
        rig={state: rig_side[state] for state in PAPER_STATES},
        rows=rows,
        sums=tuple(sum_rules(printed, paper, runs, measured_side)),
        variations=variations,
        known=known,
        registered=tuple(registered[state] for state in measured),
        matrix=matrix,
        other_rigs=others.records(),
        slips=(*matrix_rows(matrix.cells, bearing), *table6_rows(printed, bearing)),
    )


def _model_of(state: Fault, model: AnalysedRun | str) -> AnalysedRun:
    """Figures cannot do without the model's run."""
    if isinstance(model, str):
        raise NumericsError(f"the model's run beside the {state} recording failed: {model}")
    return model


def choose_rig_recordings(printed: Table6) -> dict[Fault, RegisteredRecording]:
    """The registered rig recordings to hold the model against: one nominal speed, the paper's load, no axial load.

    The speed with most of the three states wins, then the one nearest to the paper's 727 rpm; of several records of
    a state the longest, as in the matrix.
    """
    usable = [
        r
        for r in rig_recordings()
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
        state: write_stand_in(
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
