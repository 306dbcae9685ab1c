"""Public names of `srbval`, read by type checkers and by `srbval/__init__.py`, which loads a name at its first use."""

from srbval.bearing import Bearing, fault_frequencies, find_bearings, known_bearings, load_bearing
from srbval.campaign.engines import choose_engine
from srbval.campaign.run import campaign_status, load_campaign, run_campaign, verify_campaign
from srbval.check import run_check
from srbval.cli.installation_commands import doctor
from srbval.diagnosis.baseline import BaselineComparison, baseline_of, compare_with_baseline
from srbval.diagnosis.fault_verdict import Diagnosis, FaultVerdict, diagnose, fault_verdict
from srbval.diagnosis.records import RecordRequest, read_record
from srbval.errors import ConfigurationError, DataError, NumericsError, SrbvalError
from srbval.models.outside.signals import SimulatedSignals
from srbval.models.run import Run, RunStatus
from srbval.models.run_file import write_run
from srbval.models.simulate import simulate
from srbval.monitoring.batch import read_records
from srbval.monitoring.feature_rows import record_features as features
from srbval.monitoring.trend import Trend
from srbval.path.identify import identify as identify_path
from srbval.plan.plan import Plan
from srbval.plan.plan import make_plan as plan
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource, recording_from_run
from srbval.recordings.load import dataset_recordings, recording_from_columns
from srbval.recordings.registry import add as add_recordings
from srbval.recordings.registry import fetch as fetch_recordings
from srbval.recordings.registry import listing as list_recordings
from srbval.recordings.registry import recording_of as load_recording
from srbval.recordings.registry import remove as remove_recordings
from srbval.recordings.registry import verify_recordings
from srbval.report.figures.plot import plot
from srbval.report.findings.findings import Findings, gather
from srbval.report.reports import report, report_case, trend, write_plot, write_trend
from srbval.scene import Scene, load_scene, paper_scene
from srbval.signal import Spectrum, amplitude_spectrum, envelope, envelope_spectrum, kurtogram
from srbval.studies.bench import bench, stability
from srbval.studies.harness import run_study
from srbval.validation.case import ValidationCase, load_case
from srbval.validation.validate import Validation, validate

__version__: str
__all__ = [
    "Analysis",
    "BaselineComparison",
    "Bearing",
    "ConfigurationError",
    "DataError",
    "Diagnosis",
    "FaultVerdict",
    "Findings",
    "NumericsError",
    "Origin",
    "Plan",
    "RecordRequest",
    "Recording",
    "Run",
    "RunStatus",
    "Scene",
    "ShaftSpeed",
    "SimulatedSignals",
    "Spectrum",
    "SpeedSource",
    "SrbvalError",
    "Trend",
    "Validation",
    "ValidationCase",
    "__version__",
    "add_recordings",
    "amplitude_spectrum",
    "analyse",
    "baseline_of",
    "bench",
    "campaign_status",
    "choose_engine",
    "compare_with_baseline",
    "dataset_recordings",
    "diagnose",
    "doctor",
    "envelope",
    "envelope_spectrum",
    "fault_frequencies",
    "fault_verdict",
    "features",
    "fetch_recordings",
    "find_bearings",
    "gather",
    "identify_path",
    "known_bearings",
    "kurtogram",
    "list_recordings",
    "load_bearing",
    "load_campaign",
    "load_case",
    "load_recording",
    "load_scene",
    "paper_scene",
    "plan",
    "plot",
    "read_record",
    "read_records",
    "recording_from_columns",
    "recording_from_run",
    "remove_recordings",
    "report",
    "report_case",
    "run_campaign",
    "run_check",
    "run_study",
    "simulate",
    "stability",
    "trend",
    "validate",
    "verify_campaign",
    "verify_recordings",
    "write_plot",
    "write_run",
    "write_trend",
]
