"""Gather the findings of the main report: simulate, read, analyse and compare everything before anything is drawn."""

import dataclasses
from collections import defaultdict
from collections.abc import Collection, Iterable, Mapping
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.cage_readings import CageReading, cage_readings
from srbval.comparison.comparison import Row
from srbval.comparison.counterpart import PAPER_STATES, AnalysedRun, paper_runs, run_counterpart
from srbval.comparison.table6 import PAPER_CASE, table6
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analysis_once
from srbval.recordings import recording_from_run
from srbval.recordings.datasets.description import dataset
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import listing, load_entry, rig_recordings
from srbval.report.findings.findings import Findings, compared_rows
from srbval.report.findings.provenance import provenance
from srbval.report.findings.records import record_view
from srbval.report.pages import Page, load_newest_results, stored_content
from srbval.storage.content_store import ContentStore, content_sha256
from srbval.storage.tables import build
from srbval.validation.validate import PairReading, validate

CAGE_STORE = ContentStore(kind="cage", computed_by="srbval.comparison.cage_readings")

MIN_SIMULATED_S = 1.0  # below this the envelope spectrum cannot separate the lines from shaft harmonics


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
    with stage(progress, "Read the cage ratio of every record"):
        records = [load_entry(one) for one in select_simulated(of_rig, stored)]
        content = content_sha256(records, bearing)
        readings = CAGE_STORE.load(content, lambda rows: tuple(build(CageReading, row, "reading") for row in rows))
        if readings is None:
            readings = cage_readings(records, bearing)
            CAGE_STORE.save(content, readings)
    with stage(progress, "Analyse the paper's runs"):
        paper = {s: analysis_once(recording_from_run(runs[f"paper-{s}"]), bearing) for s in PAPER_STATES}
    analyses = {"paper": paper, "model": {state: side.analysis for state, side in models.items()}, "rig": rig}
    runs |= {f"counterpart-{rig[state].recording.name}": side.run for state, side in models.items()}
    with stage(progress, "Prepare the records that figures show"):
        views = {name: {s: record_view(one) for s, one in analyses[name].items()} for name in ("model", "rig")}
    registered = [entries[one.recording.file or ""] for one in rig.values()]
    found = Findings(
        data={},
        bearing=bearing,
        runs=runs,
        analyses=analyses,
        views=views,
        validation=validation,
        datasets=tuple(dataset(name) for name in dict.fromkeys(one.dataset for one in of_rig) if name),
        results=results,
        provenance=provenance(runs.values(), registered),
    )
    return dataclasses.replace(found, data=compared_rows(found, models, readings, register, registered))


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
