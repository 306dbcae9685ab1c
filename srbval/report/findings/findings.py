"""The findings: all that the report shows, as frozen data."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from srbval.bearing import Bearing, Fault
from srbval.comparison.effects import Sensitivity
from srbval.comparison.headline import Headline
from srbval.comparison.matrix import Matrix
from srbval.comparison.table6 import Table6
from srbval.models.run import Run
from srbval.plan.table import CalibrationTable
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin
from srbval.recordings.datasets.description import DatasetDescription, PublishedSpeeds
from srbval.report.findings.bearing_views import BearingViews
from srbval.report.findings.records import RecordKurtogram, RecordView
from srbval.report.pages import StoredResults
from srbval.scene import RollerFit
from srbval.signal import Scalogram


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """What the report is made of: `data`, the content of ``report.json``, and what figures draw and sections word.

    `matrix` and what `data` says of other rigs and of slip take in every registered recording; the rest shows
    the model and the rig at one of the matrix's speeds. Sides are ``paper`` (the model at 710 rpm), ``model`` (at each
    rig recording's own speed, at 710 rpm for a stand-in) and ``rig`` (its recordings, or stand-ins where a state has
    none), in `analyses` and `views`, `scalograms` without ``paper``. `runs` are those shown, by the id of their case,
    not those of every other record of the matrix; `run_facts` says how each went. `fits` are views of the model's
    outer-race defect with either roller fit. `datasets` describes, by name, every data set a recording was read from;
    `ladders` are the shipped calibrations, by their scene.
    """

    data: Mapping[str, Any]
    bearing: Bearing
    printed: Table6
    runs: Mapping[str, Run]
    run_facts: tuple[Mapping[str, Any], ...]
    analyses: Mapping[str, Mapping[Fault, Analysis]]
    views: Mapping[str, Mapping[Fault, RecordView]]
    scalograms: Mapping[str, Mapping[Fault, Scalogram]]
    fits: Mapping[RollerFit, tuple[RecordView, Scalogram]]
    bearing_views: BearingViews
    kurtograms: tuple[RecordKurtogram, ...]
    known: Sensitivity
    matrix: Matrix
    datasets: Mapping[str, DatasetDescription]
    speed_source: PublishedSpeeds
    ladders: Mapping[str, CalibrationTable]
    results: StoredResults
    provenance: Mapping[str, Any]

    @property
    def headline(self) -> Headline:
        """How far the model is from the recordings that stand in the figures."""
        found: Headline = self.data["headline"]
        return found

    @property
    def measured_states(self) -> tuple[Fault, ...]:
        """States for which the rig side is a measured recording."""
        return tuple(s for s, one in self.analyses["rig"].items() if one.recording.origin is Origin.MEASURED)
