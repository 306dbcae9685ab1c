"""Gather data on a user's recordings: fault lines, why some are not detected, comparison with the model."""

import dataclasses
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.comparison.counterpart import SimulationCase, run_cases
from srbval.diagnosis.records import FailedFile, RecordReading, RecordRequest, common_error, read_record, summary_of
from srbval.errors import ConfigurationError, SrbvalError
from srbval.models.run import Run
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import Line
from srbval.recordings import Origin, recording_from_run
from srbval.report.findings.provenance import provenance
from srbval.report.findings.records import (
    RecordView,
    SpectrumView,
    first_lines,
    marked_line,
    record_view,
    record_views,
    spectrum_view,
)
from srbval.scene import load_scene
from srbval.storage.json_files import to_json

MODEL_TURNS = 30.0  # shaft turns of the model's run, enough to detect its lines
OPEN_CAGE = 5e-3  # 95 % half width of a ball bearing's cage ratio: contact angles up to 18 degrees, and slip
MAX_BAND_SHARE_OF_RATE = 0.45  # upper end of the model's band, as a share of the run's sampling rate


@dataclass(frozen=True, kw_only=True, eq=False)
class ModelSide:
    """Run of the model at a record's speed in the bearing state `state`, and the run's arrays for figures.

    `open_cage` is the relative 95 % half width of the model's cage speed, due to unknown contact angle and slip; it is
    0 for a spherical roller bearing of known geometry. `stated_load` is false if the record states no load; then the
    load of the bundled scene `base` was used.
    """

    run: Run
    base: str
    state: Fault
    stated_load: bool
    open_cage: float
    view: RecordView

    @property
    def lines(self) -> dict[str, tuple[float, float]]:
        """Fault frequencies [Hz] of the model at its mean cage speed, with 95 % half widths [%]."""
        elements, shaft_hz = self.view.analysis.bearing.rolling_elements, self.view.shaft_hz
        cage, ci95 = self.run.cage_ratio, self.open_cage
        return {
            "BPFO": (elements * cage * shaft_hz, 100 * ci95),
            "BPFI": (elements * (1 - cage) * shaft_hz, 100 * ci95 * cage / (1 - cage)),
            "FTF": (cage * shaft_hz, 100 * ci95),
        }

    def to_dict(self) -> dict[str, Any]:
        """Return the run's entry in ``report.json``."""
        own = {name: getattr(self.run, name) for name in ("status", "cage_ratio", "bpfo_hz", "bpfi_hz")}
        origin = {"scene": self.base, "model": self.run.scene.model, "state": self.state}
        return origin | own | {"open_cage": self.open_cage, "analysis": self.view.analysis}


@dataclass(frozen=True, kw_only=True, eq=False)
class UserRecord(RecordReading):
    """Analysed recording with its envelope spectrum, and the line whose harmonics are marked in the spectrum.

    `model` is None if no model was run, and the reason as a text if its run failed.
    """

    view: SpectrumView
    marked: Line | None
    model: ModelSide | str | None

    def to_dict(self) -> dict[str, Any]:
        """Return the recording's entry in ``report.json``: all numbers, but no arrays, which figures store as CSV."""
        baseline, model = self.baseline, self.model
        shown = baseline and {name: getattr(baseline, name) for name in ("conditions", "remarks", "analysis")}
        return super().to_dict() | {
            "unseen": {line.name: line.not_detected for line in first_lines(self.analysis) if not line.detected},
            "baseline": shown,
            "model": {"failed": model} if isinstance(model, str) else model,
        }


def summary_rows(records: Iterable[UserRecord | Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each analysed recording (or its JSON document), for the report's table of all recordings."""
    return [summary_of(to_json(record)) for record in records]


def gather_user_records(
    requests: Sequence[RecordRequest], *, model: bool = True, progress: Progress = silent
) -> tuple[tuple[UserRecord, ...], list[FailedFile], dict[str, Any]]:
    """Analyse recordings of one bearing; compare each with a healthy record, given or registered for the same rig.

    Returns the records, the files that could not be read or analysed, and the provenance. If `model` is true, the model
    is run for comparison with each measured record of a bearing with known dimensions. If no recording can be analysed,
    an error with the reasons is raised.
    """
    if not requests:
        raise ConfigurationError("no recording is given: name at least one file.")
    records, failed = list[UserRecord](), list[FailedFile]()
    for request in requests:
        own = request.recording
        file = request.file if own is None else own.file or own.name
        try:
            with stage(progress, f"Analyse {Path(file).name}"):
                reading = read_record(request)
            bearing = request.bearing or reading.analysis.recording.bearing
            compared = _model_side(reading.analysis, reading.verdict.part, bearing, progress) if model else None
            records.append(user_record(reading, compared))
        except SrbvalError as error:
            failed.append(FailedFile(file=file, error=error))
    if not records:
        raise common_error(failed)
    runs = [record.model.run for record in records if isinstance(record.model, ModelSide)]
    analyses = [record.analysis for record in records]
    used = [one.recording for one in (*analyses, *(r.baseline.analysis for r in records if r.baseline is not None))]
    names = {r.name if r.file is None else Path(r.file).name: r.sha256 for r in used}
    facts = provenance(runs, ()) | {"recordings": names}
    return tuple(records), failed, {key: value for key, value in facts.items() if value}


def user_record(reading: RecordReading, model: ModelSide | str | None = None) -> UserRecord:
    """Prepare a recording for the report: choose the line to mark, make the spectrum, and attach the model's run."""
    analysis, verdict, baseline = reading.analysis, reading.verdict, reading.baseline
    line = verdict.part.line if verdict.part is not None else verdict.comparison.line
    marked = marked_line(analysis) if line is None else analysis.line(line)
    view = spectrum_view(*record_views(analysis, None if baseline is None else baseline.analysis), marked)
    own = {field.name: getattr(reading, field.name) for field in dataclasses.fields(RecordReading)}
    return UserRecord(**own, view=view, marked=marked, model=model)


def _model_side(
    analysis: Analysis, part: Fault | None, bearing: str | None, progress: Progress
) -> ModelSide | str | None:
    """Run the model for a measured record of a known bearing; None for other records, a text if the run failed."""
    recording, geometry, elements = analysis.recording, analysis.bearing.geometry, analysis.bearing.elements
    if (geometry is None and elements is None) or recording.origin is not Origin.MEASURED or bearing is None:
        return None
    state = part or recording.state or Fault.HEALTHY
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
        scene = load_scene(base, changes)
        case = SimulationCase(id=f"beside-{recording.name}", purpose="beside the record", state=state, scene=scene)
        run = run_cases([case], jobs=1, progress=progress)[case.id]
        low, high = analysis.processed.band_hz
        own = (low, min(high, MAX_BAND_SHARE_OF_RATE * run.scene.output_rate_hz)) if geometry is None else None
        found = analyse(recording_from_run(run), bearing=analysis.bearing, band_hz=own)
    except SrbvalError as error:
        return str(error)
    return ModelSide(
        run=run,
        base=base,
        state=state,
        stated_load=recording.radial_n is not None,
        open_cage=OPEN_CAGE if geometry is None else 0.0,
        view=record_view(found),
    )
