"""Everything the report shows, gathered once: runs, analyses, comparisons, sums, variations."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from srbval.bearing import DEFAULT_BEARING, Bearing, load_bearing
from srbval.errors import ConfigurationError
from srbval.models.run import Run
from srbval.recordings import Origin, Recording, State
from srbval.recordings.from_run import recording_from_run
from srbval.recordings.registry import RegisteredRecording, listing, load_entry, rig_recordings
from srbval.recordings.stand_in import write_stand_in
from srbval.validation.analyse import Analysis, analyse
from srbval.validation.cases import PAPER_STATES, Case, paper_cases, rig_cases, variation_cases
from srbval.validation.comparison import Comparison
from srbval.validation.matrix import Matrix, build_matrix
from srbval.validation.matrix_runs import model_runs
from srbval.validation.other_rigs import OtherRecord, read_other_rigs
from srbval.validation.published import Table6, table6
from srbval.validation.quantity_comparison import QuantityComparison, compare
from srbval.validation.run_cases import Progress, run_cases
from srbval.validation.sensitivity import Effect
from srbval.validation.speed_and_slip import SpeedAndSlip, matrix_rows, table6_rows
from srbval.validation.sum_rule import SumRule
from srbval.validation.table6 import LINE_OF, measured_rows, published_rows, sum_rules
from srbval.validation.variation import Variation, variation

SHORTEST_S = 1.0  # below this the envelope spectrum cannot separate the lines from shaft harmonics
STAND_IN_SECONDS = 2.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """What the report is made of.

    `matrix`, `other_rigs` and `slips` take in every registered recording; the rest holds the model against the
    rig's at one speed: `paper` are the model's analyses at 710 rpm; `rig` those of the rig's recordings, or of
    stand-ins where a state has none; `beside_rig` those of the model at each rig recording's own speed (at 710 rpm
    beside a stand-in).
    """

    bearing: Bearing
    printed: Table6
    cases: tuple[Case, ...]
    runs: Mapping[str, Run]
    paper: Mapping[State, Analysis]
    beside_rig: Mapping[State, Analysis]
    rig: Mapping[State, Analysis]
    rows: tuple[Comparison, ...]
    sums: tuple[SumRule, ...]
    variations: tuple[Variation, ...]
    comparisons: tuple[QuantityComparison, ...]
    effects: tuple[Effect, ...]
    registered: tuple[RegisteredRecording, ...]
    matrix: Matrix
    other_rigs: tuple[OtherRecord, ...]
    slips: tuple[SpeedAndSlip, ...]

    @property
    def measured_states(self) -> tuple[State, ...]:
        """States for which the rig side is a measured recording."""
        return tuple(s for s in self.rig if self.rig[s].recording.origin is Origin.MEASURED)


def gather(
    *,
    seconds: float,
    stand_in_folder: Path,
    jobs: int | None = None,
    progress: Progress | None = None,
    stage: Callable[[str], None] = lambda _: None,
    effects: Sequence[Effect] = (),
) -> Evidence:
    """Run the cases and analyse everything; the rig's recordings are those registered.

    `effects` are the stored sensitivities, where there are any. `seconds` is the recorded duration of the paper's three
    runs; `stand_in_folder` receives the stand-ins'
    files, where any are needed; `stage` is told what begins. Raises what simulation and loading raise.
    """
    if seconds < SHORTEST_S:
        raise ConfigurationError(
            f"{seconds:g} s of simulation are too short to tell fault lines from shaft harmonics; use {SHORTEST_S:g} s "
            "or more."
        )
    bearing = load_bearing(DEFAULT_BEARING)
    printed = table6()
    stage("Look at the registered recordings")
    registered = choose_rig_recordings(printed)
    measured = {state: load_entry(entry) for state, entry in registered.items()}
    cases = plan_cases(measured, seconds)
    stage(f"Simulate {len(cases)} cases")
    runs = run_cases(cases, jobs=jobs, progress=progress)
    stage("Analyse model and rig")
    rig = measured | _stand_ins(set(PAPER_STATES) - set(measured), printed, stand_in_folder)
    rig_side = {state: analyse(rig[state], bearing=bearing) for state in PAPER_STATES}
    paper = {s: analyse(recording_from_run(runs[f"paper-{s}"]), bearing=bearing) for s in PAPER_STATES}
    beside = {
        s: analyse(recording_from_run(runs[f"rig-{s}"]), bearing=bearing) if s in measured else paper[s]
        for s in PAPER_STATES
    }
    variations = tuple(
        variation(c, runs[c.id], runs[f"paper-{c.state}"]) for c in cases if c.id in _variation_ids(cases)
    )
    measured_side = {s: rig_side[s] for s in measured}
    unsure = _of_effects(effects) or {
        line: math.hypot(*(v.bpfo_change_pct if line == "BPFO" else v.bpfi_change_pct for v in variations))
        for line in LINE_OF.values()
    }
    stage("Fill the validation matrix")
    everything = listing().recordings
    matrix = build_matrix(
        rig_recordings(), bearing=bearing, model_runs=model_runs(jobs=jobs, progress=progress),
        model_uncertainty_pct=unsure,
    )  # fmt: skip
    stage("Read recordings of other rigs")
    other_rigs = read_other_rigs(everything, jobs=jobs)
    rows = (
        *published_rows(printed, paper, runs),
        *measured_rows(measured_side, beside, {s: runs[f"rig-{s}"] for s in measured}, variations, effects),
    )
    return Evidence(
        bearing=bearing,
        printed=printed,
        cases=tuple(cases),
        runs=runs,
        paper=paper,
        beside_rig=beside,
        rig=rig_side,
        rows=rows,
        sums=tuple(sum_rules(printed, paper, runs, measured_side)),
        variations=variations,
        comparisons=compare(measured_side, beside, effects),
        effects=tuple(effects),
        registered=tuple(registered.values()),
        matrix=matrix,
        other_rigs=other_rigs,
        slips=(*matrix_rows(matrix.cells, bearing), *table6_rows(printed, bearing)),
    )


def _of_effects(effects: Sequence[Effect]) -> dict[str, float]:
    """What all terms together do to each race line [%]."""
    lines = {line: [e.bound_pct for e in effects if e.quantity == line] for line in LINE_OF.values()}
    return {line: math.hypot(*parts) for line, parts in lines.items() if parts}


def plan_cases(measured: Mapping[State, Recording], seconds: float) -> list[Case]:
    """The cases of a report: the paper's, one beside each measured recording, the variations."""
    speeds = {s: r.speed.value_hz for s, r in measured.items() if r.speed is not None}
    lengths = {s: r.seconds for s, r in measured.items()}
    return [*paper_cases(seconds), *rig_cases(speeds, lengths), *variation_cases(seconds)]


def choose_rig_recordings(printed: Table6) -> dict[State, RegisteredRecording]:
    """The registered rig recordings to hold the model against: one nominal speed, the paper's load, no axial load.

    The speed with most of the three states wins, then the one nearest to the paper's 727 rpm.
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
    by_speed: dict[float, dict[State, RegisteredRecording]] = {}
    for entry in usable:
        if entry.nominal_rpm is not None and entry.state is not None:
            by_speed.setdefault(entry.nominal_rpm, {}).setdefault(entry.state, entry)
    if not by_speed:
        return {}
    best = max(by_speed, key=lambda rpm: (len(by_speed[rpm]), -abs(rpm - printed.motor_rpm)))
    return {state: by_speed[best][state] for state in PAPER_STATES if state in by_speed[best]}


def _stand_ins(states: set[State], printed: Table6, folder: Path) -> dict[State, Recording]:
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


def _variation_ids(cases: Sequence[Case]) -> set[str]:
    return {c.id for c in cases if not c.id.startswith(("paper-", "rig-"))}
