"""The evidence: all that the report shows, as frozen data."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import Bearing, Fault
from srbval.comparison.bias import Bias
from srbval.comparison.comparison import Comparison
from srbval.comparison.effects import Sensitivity
from srbval.comparison.headline import Headline, headline
from srbval.comparison.matrix import Matrix
from srbval.comparison.other_rigs import OtherRecord
from srbval.comparison.speed_and_slip import SpeedAndSlip
from srbval.comparison.table6 import Table6
from srbval.models.run import Run
from srbval.reading.analyse import Analysis
from srbval.reading.shown_record import ShownRecord
from srbval.reading.sum_rule import SumRule
from srbval.recordings import Origin
from srbval.recordings.datasets.description import DatasetDescription, PublishedSpeeds
from srbval.recordings.registry import RegisteredRecording, RegisterListing
from srbval.report.findings.bands import CrossBand, RecordKurtogram
from srbval.report.findings.bearing_views import BearingViews, LoadSharing, PointPassing
from srbval.report.findings.harmonics import HarmonicPatterns
from srbval.report.findings.impulse_trains import ImpulseTrain
from srbval.report.findings.provenance import RunFacts
from srbval.report.findings.shown_records import SidebandShares
from srbval.report.findings.speeds import PublishedSpeedRow, SingleSpeed
from srbval.report.findings.stored import ShownLadder
from srbval.report.pages import StoredResults
from srbval.scene import RollerFit
from srbval.signal import Scalogram

SCHEMA_VERSION = 1


@dataclass(frozen=True, kw_only=True, eq=False)
class Evidence:
    """What the report is made of.

    `matrix`, `bias`, `other_rigs` and `slips` take in every registered recording; the rest shows the model and
    the rig at one of the matrix's speeds: `paper` are the model's analyses at 710 rpm; `rig` those of the rig's
    recordings, or of stand-ins where a state has none; `model_at_rig` those of the model at each rig recording's own
    speed (at 710 rpm for a stand-in). `runs`, with `run_facts`, are those shown, by the id of their case, not those of
    every other record of the matrix.

    `shown` holds the arrays of the figures, of the sides ``model``, ``rig`` and ``paper``; `scalograms` those of
    ``model`` and ``rig``, `fits` both of the model's outer-race defect with either roller fit; `sidebands` of the
    inner-race line, None where it was not read.
    `scene_values` are all values of the paper's outer-race scene and the bearing's geometry. `datasets` describes, by
    name, every data set a recording was read from; `results` are the stored results by
    name. `register` is all that is
    registered, usable or not.
    """

    bearing: Bearing
    printed: Table6
    runs: Mapping[str, Run]
    run_facts: tuple[RunFacts, ...]
    scene_values: Mapping[str, Any]
    paper: Mapping[Fault, Analysis]
    model_at_rig: Mapping[Fault, Analysis]
    rig: Mapping[Fault, Analysis]
    shown: Mapping[str, Mapping[Fault, ShownRecord]]
    scalograms: Mapping[str, Mapping[Fault, Scalogram]]
    sidebands: Mapping[str, SidebandShares | None]
    views: BearingViews
    load_path: LoadSharing
    point_passing: PointPassing
    patterns: HarmonicPatterns
    trains: tuple[ImpulseTrain, ...]
    fits: Mapping[RollerFit, tuple[ShownRecord, Scalogram]]
    kurtograms: tuple[RecordKurtogram, ...]
    crossed: tuple[CrossBand, ...]
    rows: tuple[dict[str, Any], ...]
    sums: tuple[SumRule, ...]
    known: Sensitivity
    registered: tuple[RegisteredRecording, ...]
    register: RegisterListing
    matrix: Matrix
    bias: tuple[Bias, ...]
    other_rigs: tuple[OtherRecord, ...]
    slips: tuple[SpeedAndSlip, ...]
    single_speed: SingleSpeed
    published_speeds: tuple[PublishedSpeedRow, ...]
    speed_source: PublishedSpeeds
    datasets: Mapping[str, DatasetDescription]
    results: StoredResults
    ladder: ShownLadder
    rig_ladder: ShownLadder
    provenance: Mapping[str, Any]

    @property
    def comparisons(self) -> tuple[Comparison, ...]:
        """Every quantity of the recordings that stand in the figures."""
        return tuple(row for cell in self.matrix.cells if cell.point in self.matrix.sides for row in cell.comparisons)

    @property
    def headline(self) -> Headline:
        """How far the model is from the recordings that stand in the figures."""
        return headline(self.comparisons, self.results.content("rig_inputs"), self.results.content("verdict_scan"))

    @property
    def measured_states(self) -> tuple[Fault, ...]:
        """States for which the rig side is a measured recording."""
        return tuple(s for s in self.rig if self.rig[s].recording.origin is Origin.MEASURED)

    @property
    def not_used(self) -> tuple[dict[str, str], ...]:
        """Registered recordings that vanished, changed or cannot be read, by the names of their files, and why."""
        gone = self.register.problems
        return tuple({"file": Path(r.file).name, "status": r.status.value, "reason": r.reason or ""} for r in gone)

    @property
    def cautions(self) -> tuple[dict[str, str], ...]:
        """What may make the numbers of a recording wrong that this report uses, each file and caution once."""
        said = [(r.file, r.cautions) for r in self.matrix.cells] + [(r.file, r.cautions) for r in self.other_rigs]
        once = dict.fromkeys((Path(file).name, caution) for file, cautions in said for caution in cautions)
        return tuple({"file": file, "caution": caution} for file, caution in once)

    def to_dict(self) -> dict[str, Any]:
        """The content of ``report.json``: all numbers; arrays that figures draw lie in the figures' data files."""
        sides = {"paper": self.paper, "beside-rig": self.model_at_rig, "rig": self.rig}
        return {
            "schema_version": SCHEMA_VERSION,
            "status": "ok",
            "headline": self.headline,
            "table6": self.rows,
            "closure": self.sums,
            "comparisons": list(self.comparisons),
            "bias": list(self.bias),
            "sensitivity": self.known.defects,
            "analyses": {
                f"{name}-{state}": analysis for name, side in sides.items() for state, analysis in side.items()
            },
            "sidebands": self.sidebands,
            "load_zone": self.views.load_zone,
            "load_path": self.load_path,
            "point_passing": self.point_passing,
            "harmonic_patterns": self.patterns,
            "impulse_trains": self.trains,
            "kurtograms": [_kurtogram(record) for record in self.kurtograms],
            "kept_results": {name: result.origin for name, result in self.results.items()},
            "ladder": self.ladder.rows,
            "rig_ladder": self.rig_ladder.rows,
            "matrix": self.matrix.cells,
            "crossed_bands": self.crossed,
            "other_rigs": self.other_rigs,
            "speed_and_slip": self.slips,
            "published_speeds": self.published_speeds,
            "single_speed": self.single_speed,
            "runs": self.run_facts,
            "scene": self.scene_values,
            "recordings": self.registered,
            "recordings_not_used": self.not_used,
            "register_unreadable": self.register.unreadable or None,
            "cautions": self.cautions,
        }


def _kurtogram(record: RecordKurtogram) -> dict[str, Any]:
    picture, second = record.kurtogram, record.second_comb
    return {
        "file": record.analysis.recording.file,
        "origin": record.analysis.recording.origin,
        "state": record.analysis.recording.state,
        "line": record.line,
        "band_hz": record.analysis.processed.band_hz,
        "most_impulsive_hz": picture.best_hz,
        "kurtosis_less_2": float(picture.kurtosis.max()),
        "bands": picture.size,
        "second_comb": None if second is None else second.line(record.line),
    }
