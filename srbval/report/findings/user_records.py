"""Gather data on a user's recordings: fault lines, why some are not detected, comparison with the model."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault, load_bearing
from srbval.comparison.compared_quantities import read_quantities
from srbval.comparison.counterpart import AnalysedRun, run_counterpart
from srbval.diagnosis.records import RecordReading, RecordRequest, read_record
from srbval.errors import SrbvalError
from srbval.monitoring.batch import FailedFile, common_error, summary_of
from srbval.progress import Progress, silent, stage
from srbval.reading.analyse import Analysis
from srbval.reading.lines import Line
from srbval.recordings import Origin
from srbval.report.findings.records import SpectrumView, first_lines, marked_line, record_views, spectrum_view
from srbval.report.pages import provenance
from srbval.storage.json_files import to_json
from srbval.validation.case import Tolerance, ValidationCase
from srbval.validation.compare import compare_pair, table_of
from srbval.validation.sides import SideReading

OPEN_CAGE = 5e-3  # 95 % half width of a ball bearing's cage ratio: contact angles up to 18 degrees, and slip
MAX_MODEL_BAND_HZ = 9216.0  # highest end of the model's band; the scenes' runs have 20,480 samples per second


@dataclass(frozen=True, kw_only=True, eq=False)
class UserRecord(RecordReading):
    """Analysed recording; `model` is None if no model was run, and the reason as a text if its run failed."""

    model: AnalysedRun | str | None = None

    @cached_property
    def marked(self) -> Line | None:
        """Line of the fault that is named or compared with the healthy record, otherwise the clearest fault line."""
        verdict = self.verdict
        line = verdict.part.line if verdict.part is not None else verdict.comparison.line
        return marked_line(self.analysis) if line is None else self.analysis.line(line)

    @cached_property
    def view(self) -> SpectrumView:
        """Envelope spectrum of the recording, and of the healthy record if there is one."""
        healthy = None if self.baseline is None else self.baseline.analysis
        return spectrum_view(*record_views(self.analysis, healthy), self.marked)

    def to_dict(self) -> dict[str, Any]:
        """Return the recording's entry in ``report.json``: all numbers, but no arrays, which figures store as CSV."""
        baseline, model, bearing = self.baseline, self.model, self.analysis.bearing
        of_model: Any = {"failed": model} if isinstance(model, str) else None
        if isinstance(model, AnalysedRun):
            own = {name: getattr(model.run, name) for name in ("status", "cage_ratio", "bpfo_hz", "bpfi_hz")}
            of_model = {"scene": base_scene(bearing), "model": model.run.scene.model, "state": model.state} | own
            of_model |= {"open_cage": 0.0 if bearing.geometry else OPEN_CAGE, "analysis": model.analysis}
        return super().to_dict() | {
            "unseen": {line.name: line.not_detected for line in first_lines(self.analysis) if not line.detected},
            "baseline": baseline and {key: getattr(baseline, key) for key in ("conditions", "remarks", "analysis")},
            "model": of_model,
        }


def summary_rows(records: Sequence[UserRecord], others: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Return one row for each of the `records`, and for each of the JSON documents `others`, for a table of all."""
    return [summary_of(to_json(one)) for one in (*records, *others)]


def gather_user_records(
    requests: Sequence[RecordRequest], *, progress: Progress = silent
) -> tuple[tuple[UserRecord, ...], list[FailedFile], dict[str, Any]]:
    """Analyse recordings of one bearing; compare each with a healthy record, given or registered for the same rig.

    Returns the records, the files that could not be read or analysed, and the provenance. The model is run for
    comparison with each measured record of a bearing with known dimensions. If no recording can be analysed, an error
    with the reasons is raised.
    """

    records, failed = list[UserRecord](), list[FailedFile]()
    for request in requests:
        own = request.recording
        file = request.file if own is None else own.file or own.name
        try:
            with stage(progress, f"Analyse {Path(file).name}"):
                reading = read_record(request)
            bearing = request.bearing or reading.analysis.recording.bearing
            compared = _model_side(reading.analysis, reading.verdict.part, bearing, progress)
            records.append(UserRecord(**vars(reading), model=compared))
        except SrbvalError as error:
            failed.append(FailedFile(file=file, error=error))
    if not records:
        raise common_error(failed)
    runs = [record.model.run for record in records if isinstance(record.model, AnalysedRun)]
    analyses = [record.analysis for record in records]
    used = [one.recording for one in (*analyses, *(r.baseline.analysis for r in records if r.baseline is not None))]
    names = {r.name if r.file is None else Path(r.file).name: r.sha256 for r in used}
    return tuple(records), failed, provenance(runs, names)


def _model_side(
    analysis: Analysis, part: Fault | None, bearing: str | None, progress: Progress
) -> AnalysedRun | str | None:
    """Run the model for a measured record of a known bearing; None for other records, a text if the run failed."""
    recording, own = analysis.recording, analysis.bearing
    if (own.geometry is None and own.elements is None) or recording.origin is not Origin.MEASURED or bearing is None:
        return None
    state, (low, high) = part or recording.state or Fault.HEALTHY, analysis.processed.band_hz
    band_hz = (low, min(high, MAX_MODEL_BAND_HZ)) if own.geometry is None else None
    told: dict[str, Any] = {"bearing_name": bearing, "progress": progress}
    try:
        return run_counterpart(analysis, state, base_scene(own), band_hz, **told)
    except SrbvalError as error:
        return str(error)


def base_scene(bearing: Bearing) -> str:
    """Name of the bundled scene on whose inputs the model's run is based."""
    same = bearing.geometry is not None and bearing.geometry == load_bearing(DEFAULT_BEARING).geometry
    return "rig" if same else "paper"


def compare_with_model(analysis: Analysis, model: AnalysedRun) -> pd.DataFrame | None:
    """Compare a record with the model as `validate` does; None if the record does not show the model's fault line."""
    state = model.state
    if not state.line or not analysis.line_of(state).detected:
        return None
    stated = Tolerance() if analysis.bearing.geometry else Tolerance(cage_pct=100 * OPEN_CAGE)
    case = ValidationCase(bearing=model.run.scene.bearing, uncertainty=stated)
    sides = {
        "simulated": SideReading(analyses=(model.analysis,), values=(model.values,)),
        "measured": SideReading(analyses=(analysis,), values=(read_quantities(analysis, state, None),)),
    }
    return table_of(list(compare_pair(1, state, sides, case, {}, "withheld")), case.tolerance)
