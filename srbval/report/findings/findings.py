"""All data that the sections and figures of the main report need; sections and figures compute nothing."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from srbval.bearing import Bearing, Fault
from srbval.comparison.cage_readings import CageReading
from srbval.comparison.comparison import plain_frame
from srbval.comparison.table6 import Published
from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.recordings.datasets.description import DatasetDescription
from srbval.report.findings.records import RecordView
from srbval.report.pages import StoredResults
from srbval.signal import Scalogram
from srbval.storage.json_files import to_json
from srbval.validation.validate import Validation

if TYPE_CHECKING:
    import pandas as pd

Side = Mapping[Fault, Analysis]


@dataclass(frozen=True, kw_only=True, eq=False)
class Findings:
    """Content of ``report.json`` (`data`), and the runs, analyses and arrays behind the sections and figures.

    `validation` covers every recording of the rig. `analyses` contains one analysis for each side and bearing state;
    the sides are ``paper`` (model at 710 rpm), ``rig`` (one recording per state) and ``model`` (model at the speed of
    this recording). `views` (arrays for figures) and `scalograms` have only the sides ``model`` and ``rig``. The keys
    of `runs` are ids of simulation cases.
    """

    data: Mapping[str, Any]
    bearing: Bearing
    printed: Mapping[Fault, Published]
    runs: Mapping[str, Run]
    run_facts: tuple[Mapping[str, Any], ...]
    analyses: Mapping[str, Side]
    views: Mapping[str, Mapping[Fault, RecordView]]
    scalograms: Mapping[str, Mapping[Fault, Scalogram]]
    validation: Validation
    cage_readings: tuple[CageReading, ...]
    datasets: tuple[DatasetDescription, ...]
    results: StoredResults
    provenance: Mapping[str, Any]

    def sides_of(self, state: Fault) -> tuple[list[RecordView], list[Scalogram]]:
        """Return the arrays for figures and the scalograms of one bearing state, each as a list [model, rig]."""
        return [side[state] for side in self.views.values()], [side[state] for side in self.scalograms.values()]

    def frame(self, key: str) -> "pd.DataFrame":
        """Return the table stored under `key` in ``report.json``, such as ``table6``, as a data frame."""
        return plain_frame(to_json(list(self.data[key])))
