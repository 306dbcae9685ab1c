"""Findings on a user's recordings: lines, what was not detected and why, a healthy record, the model to compare."""

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.cage_inputs import CageInputs, cage_inputs
from srbval.comparison.counterpart import SimulationCase, run_cases
from srbval.diagnosis.baseline import (
    Baseline,
    BaselineComparison,
    baseline_of,
    compare_with_baseline,
    is_fault_like,
    registered_baseline,
)
from srbval.diagnosis.diagnose import Diagnosis, diagnose
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.models.run import Run
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analyse, bearing_of
from srbval.reading.lines import OTHER_LINE, Line
from srbval.reading.pipeline import USABLE_SHARE, declared_band
from srbval.recordings import Origin, Recording, recording_from_run
from srbval.report.findings.provenance import provenance
from srbval.report.findings.records import (
    RecordView,
    SpectrumView,
    first_lines,
    marked_line,
    record_view,
    spectrum_view,
    views_of,
)
from srbval.scene import load_scene
from srbval.signal import LEAST_SNR
from srbval.signal.comb import FALSE_ALARM, PLACEBO_FALSE_ALARM

MODEL_TURNS = 30.0  # length of the model's run: enough for its lines
HIGHEST_SHARE = 0.45  # of a run's rate, where a record's band reaches beyond it


class NotDetected(enum.StrEnum):
    """Why a line is not counted as detected."""

    OUT_OF_REACH = "out of reach"
    HIDDEN = "hidden by the shaft"
    PART_OF_OTHER = "part of another line"
    ANOTHER = "another line"
    WEAK = "too weak"
    NOISE = "noise"
    MEANINGLESS = "meaningless"
    FLANK = "flank"


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelSide:
    """The model at a record's speed, with the defect of `state`: its run, and what figures show of it.

    `stated_load` says whether the record states its load, or the scene's own was taken; `open_cage` what is open of the
    cage's speed, where the model takes that from dimensions.
    """

    run: Run
    base: str
    state: Fault
    stated_load: bool
    open_cage: CageInputs | None
    view: RecordView

    @property
    def lines(self) -> dict[str, tuple[float, float]]:
        """Lines at the cage's mean speed [Hz], with 95 % half widths of what is open of it [%]."""
        elements, shaft_hz = self.view.analysis.bearing.rolling_elements, self.view.shaft_hz
        shift, ci95 = (0.0, 0.0) if self.open_cage is None else (self.open_cage.shift, self.open_cage.ci95)
        cage = self.run.cage_ratio * (1 + shift)
        return {
            "BPFO": (elements * cage * shaft_hz, 100 * ci95),
            "BPFI": (elements * (1 - cage) * shaft_hz, 100 * ci95 * cage / (1 - cage)),
            "FTF": (cage * shaft_hz, 100 * ci95),
        }

    def to_dict(self) -> dict[str, Any]:
        """Its entry in ``report.json``."""
        run = self.run
        return {
            "scene": self.base, "model": run.scene.model, "state": self.state, "status": run.status,
            "cage_ratio": run.cage_ratio, "bpfo_hz": run.bpfo_hz, "bpfi_hz": run.bpfi_hz, "open_cage": self.open_cage,
            "analysis": self.view.analysis,
        }  # fmt: skip


@dataclass(frozen=True, kw_only=True, eq=False)
class UserRecord:
    """One recording with all that the report says of it.

    `view` is its envelope spectrum with that of the healthy record; `marked` the line whose harmonics are marked there,
    None where no fault's line was detected. `not_detected` are the first harmonics that were looked for and not counted
    as detected, with the reason. `naming` is what the record says by itself, None where it is not measured. `model` is
    a text where the model's run failed, None where there is no model.
    """

    analysis: Analysis
    call: BaselineComparison
    naming: Diagnosis | None
    baseline: Baseline | None
    view: SpectrumView
    marked: Line | None
    not_detected: tuple[tuple[Line, NotDetected], ...]
    model: ModelSide | str | None

    @property
    def doubted(self) -> bool:
        """Whether the line that rose is shallow and not named by the record alone: other parts' faults raise it too."""
        named = self.naming is None or self.naming.state == self.call.called
        deep = self.marked is not None and is_fault_like(self.analysis, self.marked)
        return self.call.called is not None and not named and not deep

    def to_dict(self) -> dict[str, Any]:
        """The record's entry in ``report.json``: all numbers; arrays that figures draw lie in their data files."""
        baseline, model = self.baseline, self.model
        return self.analysis.to_dict() | {
            "fault": self.call,
            "naming": self.naming,
            "unseen": {line.name: why for line, why in self.not_detected},
            "baseline": baseline
            and {"conditions": baseline.conditions, "remarks": baseline.remarks, "analysis": baseline.analysis},
            "model": {"failed": model} if isinstance(model, str) else model,
        }


@dataclass(frozen=True, kw_only=True)
class FailedFile:
    """A recording's file that could not be read or analysed, and the error."""

    file: str
    error: SrbvalError

    def to_dict(self) -> dict[str, str]:
        """Its entry in ``report.json``."""
        return {"file": self.file, "reason": str(self.error)}


def gather_user_records(
    recordings: Sequence[Recording | FailedFile],
    *,
    bearing: str | None = None,
    healthy: Recording | None = None,
    band_hz: tuple[float, float] | None = None,
    model: bool = True,
    all_channels: bool = False,
    largest_slip_pct: float | None = None,
    progress: Progress = silent,
) -> tuple[tuple[UserRecord, ...], tuple[FailedFile, ...], dict[str, Any]]:
    """Analyse recordings of one bearing, each against `healthy`, or else the registered healthy record of its rig.

    Returns the records, what could not be read or analysed, and the provenance.
    `bearing` is a known name or a file, without it that of the recordings' data set. Where neither `band_hz` [Hz] nor
    the data set says which band to demodulate, one is chosen on each record, with its trials counted. The
    model is compared with a measured record where the bearing's dimensions are known and `model` is left True.
    `all_channels`: see `diagnose`; `largest_slip_pct`: see `bearing_of`. Raises the error of the records
    where none can be analysed; a model's run that fails is only said.
    """
    if not recordings:
        raise ConfigurationError("no recording is given: name at least one file.")

    def gather_one(recording: Recording) -> UserRecord:
        with stage(progress, f"Analyse {recording.name}"):
            chosen = bearing_of(recording, bearing, largest_slip_pct=largest_slip_pct)
            unknown = band_hz is None and not _band_is_declared(recording)
            analysis = analyse(recording, bearing=chosen, band_hz=band_hz, choose_on_record=unknown)
            other = healthy if healthy is not None else registered_baseline(analysis)
            baseline = None if other is None else baseline_of(analysis, other)
        name = bearing or recording.bearing
        compared = _model_side(analysis, compare_with_baseline(analysis, baseline), name, progress) if model else None
        measured = recording.origin is Origin.MEASURED
        naming = diagnose(analysis, all_channels=all_channels) if measured else None
        return user_record(analysis, baseline, compared, naming)

    records, failed = list[UserRecord](), list[FailedFile]()
    for recording in recordings:
        if isinstance(recording, FailedFile):
            failed.append(recording)
            continue
        try:
            records.append(gather_one(recording))
        except SrbvalError as error:
            failed.append(FailedFile(file=recording.file or recording.name, error=error))
    if not records:
        raise _only_error(failed)
    runs = [record.model.run for record in records if isinstance(record.model, ModelSide)]
    analyses = [record.analysis for record in records]
    used = [one.recording for one in (*analyses, *(r.baseline.analysis for r in records if r.baseline is not None))]
    facts = provenance(runs, ()) | {
        "recordings": {r.name if r.file is None else Path(r.file).name: r.sha256 for r in used}
    }
    facts = {key: value for key, value in facts.items() if value}
    return tuple(records), tuple(failed), facts


def _only_error(failed: Sequence[FailedFile]) -> SrbvalError:
    """The error that all these files have in common, or one that lists theirs."""
    first, *others = {str(one.error): one.error for one in failed}.values()
    if not others:
        return first
    return DataError("none of the recordings can be reported: " + "; ".join(f"{o.file}: {o.error}" for o in failed))


def why_not_detected(line: Line, analysis: Analysis) -> NotDetected | None:
    """Why a first harmonic is not counted as detected; None where it is."""
    if line.detected:
        return None
    width = analysis.processed.band_hz[1] - analysis.processed.band_hz[0]
    if line.found_hz is None:
        beyond = (1 + analysis.bearing.largest_slip) * line.kinematic_hz > USABLE_SHARE * width
        return NotDetected.OUT_OF_REACH if beyond else NotDetected.HIDDEN
    if line.explained_by is not None:
        return NotDetected.ANOTHER if line.explained_by == OTHER_LINE else NotDetected.PART_OF_OTHER
    if (line.snr or 0.0) <= LEAST_SNR:
        return NotDetected.WEAK
    if (line.noise_false_alarm or 0.0) >= FALSE_ALARM:
        return NotDetected.NOISE
    return NotDetected.MEANINGLESS if (line.placebo_false_alarm or 0.0) >= PLACEBO_FALSE_ALARM else NotDetected.FLANK


def _band_is_declared(recording: Recording) -> bool:
    try:
        declared_band(recording, None)
    except ConfigurationError:
        return False
    return True


def user_record(
    analysis: Analysis, baseline: Baseline | None, model: ModelSide | str | None = None, naming: Diagnosis | None = None
) -> UserRecord:
    """What the report says of one analysis, compared with a healthy record and a model where there are any."""
    call = compare_with_baseline(analysis, baseline)
    marked = marked_line(analysis) if call.line is None else analysis.line(call.line)
    reasons = ((line, why_not_detected(line, analysis)) for line in first_lines(analysis))
    return UserRecord(
        analysis=analysis,
        call=call,
        naming=naming,
        baseline=baseline,
        view=spectrum_view(*views_of(analysis, None if baseline is None else baseline.analysis), marked),
        marked=marked,
        not_detected=tuple((line, why) for line, why in reasons if why is not None),
        model=model,
    )


def _model_side(
    analysis: Analysis, call: BaselineComparison, bearing: str | None, progress: Progress
) -> ModelSide | str | None:
    """The model at the record's speed with the defect declared or indicated; None where the bearing has no model."""
    recording, geometry, elements = analysis.recording, analysis.bearing.geometry, analysis.bearing.elements
    if (geometry is None and elements is None) or recording.origin is not Origin.MEASURED or bearing is None:
        return None
    state = recording.state or call.called or call.indicated or Fault.HEALTHY
    base = "rig" if geometry is not None and geometry == load_bearing(DEFAULT_BEARING).geometry else "paper"
    load = {"radial_n": recording.radial_n, "axial_n": recording.axial_n}
    changes = {
        "bearing": bearing,
        "shaft_speed_rad_s": 2 * math.pi * analysis.speed.value_hz,
        "duration_s": MODEL_TURNS / analysis.speed.value_hz,
        "load": {key: value for key, value in load.items() if value is not None},
        "defect": {"kind": state.scene_word},
    }
    try:
        case = SimulationCase(
            id=f"beside-{recording.name}", purpose="beside the record", state=state, scene=load_scene(base, changes),
            base=base,
        )  # fmt: skip
        run = run_cases([case], jobs=1, progress=progress)[case.id]
        low, high = analysis.processed.band_hz
        own = (low, min(high, HIGHEST_SHARE * run.scene.output_rate_hz)) if geometry is None else None
        found = analyse(recording_from_run(run), bearing=analysis.bearing, band_hz=own)
    except SrbvalError as error:
        return str(error)
    return ModelSide(
        run=run, base=base, state=state, stated_load=recording.radial_n is not None,
        open_cage=cage_inputs(elements) if geometry is None and elements is not None else None,
        view=record_view(found),
    )  # fmt: skip
