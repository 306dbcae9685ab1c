"""The evidence for the user's recordings: lines, what was not seen and why, a healthy record, the model to compare."""

import dataclasses
import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.comparison.cage_inputs import CageInputs, cage_inputs
from srbval.comparison.counterpart import SimulationCase, run_cases
from srbval.diagnosis.baseline import baseline_of, registered_baseline
from srbval.diagnosis.baseline_comparison import Baseline, BaselineComparison, compare_with_baseline, is_fault_like
from srbval.diagnosis.diagnose import Diagnosis, diagnose
from srbval.errors import ConfigurationError, SrbvalError
from srbval.models.run import Run
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analyse, bearing_of
from srbval.reading.band_choice import declared_band
from srbval.reading.families import OTHER_LINE
from srbval.reading.lines import Line
from srbval.reading.shown_record import ShownRecord, shown_record
from srbval.reading.speed_search import USABLE_SHARE
from srbval.recordings import Origin, Recording, recording_from_run
from srbval.report.figures.analysis import (
    NORMALISED,
    OWN_UNIT,
    expected_lines,
    first_lines,
    in_own_unit,
    marked_line,
    middle_window,
    own_peaks,
    spectrum_end_hz,
)
from srbval.report.figures.spectrum import Cursor
from srbval.report.findings.provenance import provenance
from srbval.scene import load_scene
from srbval.signal import LEAST_SNR
from srbval.signal.comb import FALSE_ALARM, PLACEBO_FALSE_ALARM

SCHEMA_VERSION = 1
MODEL_TURNS = 30.0  # length of the model's run: enough for its lines
HIGHEST_SHARE = 0.45  # of a run's rate, where a record's band reaches beyond it


class Unseen(enum.StrEnum):
    """Why a line is not counted as seen."""

    OUT_OF_REACH = "out of reach"
    HIDDEN = "hidden by the shaft"
    PART_OF_OTHER = "part of another line"
    ANOTHER = "another line"
    WEAK = "too weak"
    NOISE = "noise"
    MEANINGLESS = "meaningless"
    FLANK = "flank"


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelResult:
    """The model at a record's speed, with the defect of `state`: its run, its analysis and arrays for figures.

    `stated_load` says whether the record states its load, or the scene's own was taken; `open_cage` what is open of the
    cage's speed, where the model takes that from dimensions.
    """

    run: Run
    base: str
    state: Fault
    stated_load: bool
    open_cage: CageInputs | None
    analysis: Analysis
    shown: ShownRecord

    @property
    def lines(self) -> dict[str, tuple[float, float]]:
        """Lines at the cage's mean speed [Hz], with 95 % half widths of what is open of it [%]."""
        elements, shaft_hz = self.analysis.bearing.rolling_elements, self.analysis.speed.value_hz
        shift, ci95 = (0.0, 0.0) if self.open_cage is None else (self.open_cage.shift, self.open_cage.ci95)
        cage = self.run.cage_ratio * (1 + shift)
        return {
            "BPFO": (elements * cage * shaft_hz, 100 * ci95),
            "BPFI": (elements * (1 - cage) * shaft_hz, 100 * ci95 * cage / (1 - cage)),
            "FTF": (cage * shaft_hz, 100 * ci95),
        }

    @property
    def peaks(self) -> tuple[tuple[float, float], ...]:
        """Frequency [Hz] and height of what was detected in the run."""
        return own_peaks(self.shown)


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnRecord:
    """One recording with all that the report says of it.

    `shown` and `healthy` hold the arrays of the figures, in `unit`; `window_s` is what they show in time, and
    `spectrum_hz` where their spectra end. `marked` is the line whose harmonics are marked there, None where no fault's
    line was detected, `expected` all that is marked. `unseen` are the first harmonics that were looked for and not
    counted as seen, with the reason.
    `model` is a text where the model's run failed, None where there is no model. `naming` is what the record says by
    itself, None where it is not measured.
    """

    analysis: Analysis
    call: BaselineComparison
    naming: Diagnosis | None
    baseline: Baseline | None
    unit: str
    shown: ShownRecord
    healthy: ShownRecord | None
    window_s: tuple[float, float]
    spectrum_hz: float
    marked: Line | None
    expected: tuple[Cursor, ...]
    unseen: tuple[tuple[Line, Unseen], ...]
    model: ModelResult | str | None

    @property
    def peaks(self) -> tuple[tuple[float, float], ...]:
        """Frequency [Hz] and height of what was detected, of the lines that were themselves."""
        return own_peaks(self.shown)

    @property
    def first_lines(self) -> tuple[Line, ...]:
        """The first harmonic of every family."""
        return first_lines(self.analysis)

    @property
    def doubted(self) -> bool:
        """Whether the line that rose is shallow and not named by the record alone: other parts' faults raise it too."""
        named = self.naming is None or self.naming.state == self.call.called
        deep = self.marked is not None and is_fault_like(self.analysis, self.marked)
        return self.call.called is not None and not named and not deep

    def to_dict(self) -> dict[str, Any]:
        """The record's entry in ``report.json``."""
        baseline, model = self.baseline, self.model
        return self.analysis.to_dict() | {
            "fault": self.call,
            "naming": self.naming,
            "unseen": {line.name: why for line, why in self.unseen},
            "baseline": baseline
            and {"conditions": baseline.conditions, "remarks": baseline.remarks, "analysis": baseline.analysis},
            "model": {"failed": model} if isinstance(model, str) else model and _model_entry(model),
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class OwnEvidence:
    """What a report on one's own recordings is made of."""

    bearing: Bearing
    records: tuple[OwnRecord, ...]
    provenance: Mapping[str, Any]

    def to_dict(self) -> dict[str, Any]:
        """The content of ``report.json``: all numbers; arrays that figures draw lie in the figures' data files."""
        return {"schema_version": SCHEMA_VERSION, "status": "ok", "bearing": self.bearing, "records": self.records}


def gather_own(
    recordings: Sequence[Recording],
    *,
    bearing: str | None = None,
    healthy: Recording | None = None,
    band_hz: tuple[float, float] | None = None,
    model: bool = True,
    all_channels: bool = False,
    largest_slip_pct: float | None = None,
    progress: Progress = silent,
) -> OwnEvidence:
    """Analyse recordings of one bearing, each against `healthy`, or else the registered healthy record of its rig.

    `bearing` is a known name or a file, without it that of the recordings' data set. Where neither `band_hz` [Hz] nor
    the data set says which band to demodulate, one is chosen on each record, with its trials counted. The
    model is compared with a measured record where the bearing's dimensions are known and `model` is left True.
    `all_channels`: see `diagnose`; `largest_slip_pct`: see `bearing_of`. Raises what reading a record raises; a
    model's run that fails is only said.
    """
    if not recordings:
        raise ConfigurationError("no recording is given: name at least one file.")
    records = []
    for recording in recordings:
        with stage(progress, f"Analyse {recording.name}"):
            chosen = bearing_of(recording, bearing, largest_slip_pct=largest_slip_pct)
            unknown = band_hz is None and not _band_is_declared(recording)
            analysis = analyse(recording, bearing=chosen, band_hz=band_hz, choose_on_record=unknown)
            other = healthy if healthy is not None else registered_baseline(analysis)
            baseline = None if other is None else baseline_of(analysis, other)
        name = bearing or recording.bearing
        compared = _model_result(analysis, compare_with_baseline(analysis, baseline), name, progress) if model else None
        measured = recording.origin is Origin.MEASURED
        naming = diagnose(analysis, all_channels=all_channels) if measured else None
        records.append(own_record(analysis, baseline, compared, naming))
    runs = [record.model.run for record in records if isinstance(record.model, ModelResult)]
    used = [*recordings, *(r.baseline.analysis.recording for r in records if r.baseline is not None)]
    facts = provenance(runs, ()) | {
        "recordings": {r.name if r.file is None else Path(r.file).name: r.sha256 for r in used}
    }
    facts = {key: value for key, value in facts.items() if value}
    return OwnEvidence(bearing=records[0].analysis.bearing, records=tuple(records), provenance=facts)


def why_unseen(line: Line, analysis: Analysis) -> Unseen | None:
    """Why a first harmonic is not counted as seen; None where it is."""
    if line.detected:
        return None
    width = analysis.processed.band_hz[1] - analysis.processed.band_hz[0]
    if line.found_hz is None:
        beyond = (1 + analysis.bearing.largest_slip) * line.kinematic_hz > USABLE_SHARE * width
        return Unseen.OUT_OF_REACH if beyond else Unseen.HIDDEN
    if line.explained_by is not None:
        return Unseen.ANOTHER if line.explained_by == OTHER_LINE else Unseen.PART_OF_OTHER
    if (line.snr or 0.0) <= LEAST_SNR:
        return Unseen.WEAK
    if (line.noise_false_alarm or 0.0) >= FALSE_ALARM:
        return Unseen.NOISE
    return Unseen.MEANINGLESS if (line.placebo_false_alarm or 0.0) >= PLACEBO_FALSE_ALARM else Unseen.FLANK


def _band_is_declared(recording: Recording) -> bool:
    try:
        declared_band(recording, None)
    except ConfigurationError:
        return False
    return True


def own_record(
    analysis: Analysis,
    baseline: Baseline | None,
    model: ModelResult | str | None = None,
    naming: Diagnosis | None = None,
) -> OwnRecord:
    """What the report says of one analysis, compared with a healthy record and a model where there are any."""
    call = compare_with_baseline(analysis, baseline)
    compared = [analysis] if baseline is None else [analysis, baseline.analysis]
    own_unit, window_s = in_own_unit(compared), middle_window(compared)
    marked = marked_line(analysis) if call.line is None else analysis.line(call.line)
    end_hz = spectrum_end_hz(analysis, marked)
    shown = shown_record(analysis, window_s=window_s, own_unit=own_unit)
    return OwnRecord(
        analysis=analysis,
        call=call,
        naming=naming,
        baseline=baseline,
        unit=OWN_UNIT if own_unit else NORMALISED,
        shown=shown,
        healthy=None
        if baseline is None
        else _on_axis_of(shown, shown_record(baseline.analysis, window_s=window_s, own_unit=own_unit)),
        window_s=window_s,
        spectrum_hz=end_hz,
        marked=marked,
        expected=expected_lines(analysis, marked, end_hz),
        unseen=tuple((x, why) for x in first_lines(analysis) if (why := why_unseen(x, analysis)) is not None),
        model=model,
    )


def _on_axis_of(shown: ShownRecord, other: ShownRecord) -> ShownRecord:
    """`other` with its Welch spectrum at the frequencies of `shown`; NaN beyond its own."""
    level = np.interp(shown.power_hz, other.power_hz, other.power_db, right=math.nan)
    return dataclasses.replace(other, power_hz=shown.power_hz, power_db=level)


def _model_result(
    analysis: Analysis, call: BaselineComparison, bearing: str | None, progress: Progress
) -> ModelResult | str | None:
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
    return ModelResult(
        run=run, base=base, state=state, stated_load=recording.radial_n is not None,
        open_cage=cage_inputs(elements) if geometry is None and elements is not None else None, analysis=found,
        shown=shown_record(found, window_s=middle_window([found])),
    )  # fmt: skip


def _model_entry(model: ModelResult) -> dict[str, Any]:
    run = model.run
    return {
        "scene": model.base, "model": run.scene.model, "state": model.state, "status": run.status,
        "cage_ratio": run.cage_ratio, "bpfo_hz": run.bpfo_hz, "bpfi_hz": run.bpfi_hz, "open_cage": model.open_cage,
        "analysis": model.analysis,
    }  # fmt: skip
