"""How clear the train of impulses of an outer-race defect is, for each reading of what the paper leaves open."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from srbval.bearing import Bearing, Fault
from srbval.comparison.counterpart import SimulationCase
from srbval.models.run import Run
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.shown_record import ShownRecord, shown_record
from srbval.recordings import recording_from_run
from srbval.report.findings.harmonics import SECONDS, pattern_id
from srbval.scene import LoadPath, RollerFit, paper_scene

READINGS = tuple((fit, path) for fit in RollerFit for path in LoadPath)
PHASES = 40  # of a passage, of which the envelope's mean is taken


@dataclass(frozen=True, kw_only=True)
class ImpulseTrain:
    """The envelope in the paper's band: `contrast` is the largest over the least of its means by phase of the passage,
    `scatter_pct` the standard deviation of the passages' highest values over their mean; 1 and much for noise.
    """

    roller_fit: str
    load_path: str
    contrast: float
    scatter_pct: float
    passages: int
    rms_m_s2: float


def train_cases() -> list[SimulationCase]:
    """A run of the paper's scene with an outer-race defect in every reading that `pattern_cases` have none of."""
    return [
        SimulationCase(
            id=_id(fit, LoadPath.BEARING), purpose="how clear the impulses are", state=Fault.OUTER,
            scene=paper_scene(
                duration_s=SECONDS, defect={"kind": "outer"}, contact={"roller_fit": fit.value},
                load={"path": LoadPath.BEARING.value},
            ),
        )
        for fit in RollerFit
    ]  # fmt: skip


def impulse_trains(
    runs: Mapping[str, Run], bearing: Bearing
) -> tuple[tuple[ImpulseTrain, ...], Mapping[RollerFit, ShownRecord]]:
    """The trains in all readings, and the records of either roller fit on the paper's load path."""
    read = {key: analyse(recording_from_run(runs[_id(*key)]), bearing=bearing) for key in READINGS}
    trains = tuple(_train(*key, analysis) for key, analysis in read.items())
    return trains, {fit: shown_record(read[fit, LoadPath.HOUSING]) for fit in RollerFit}


def _id(fit: RollerFit, path: LoadPath) -> str:
    return pattern_id("full", fit) if path is LoadPath.HOUSING else f"train-{fit.value}-{path.value}"


def _train(fit: RollerFit, path: LoadPath, analysis: Analysis) -> ImpulseTrain:
    envelope, line = analysis.processed.envelope, analysis.line_of(Fault.OUTER)
    passage = np.arange(envelope.size) / analysis.processed.fs_hz * (line.found_hz or line.kinematic_hz)
    phase = (passage % 1 * PHASES).astype(int)
    by_phase = np.bincount(phase, weights=envelope) / np.bincount(phase)
    number = np.floor(passage - by_phase.argmax() / PHASES + 0.5).astype(int)  # cut where the envelope is low
    whole = range(number[0] + 1, number[-1])
    highest = np.array([envelope[number == one].max() for one in whole])
    return ImpulseTrain(
        roller_fit=fit.value, load_path=path.value, contrast=float(by_phase.max() / by_phase.min()),
        scatter_pct=100 * float(highest.std() / highest.mean()), passages=len(whole),
        rms_m_s2=float(analysis.processed.filtered.std()) * analysis.processed.scale,
    )  # fmt: skip
