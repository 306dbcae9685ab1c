"""Which harmonic of BPFO is missing, by model and bump height; how clear impulses are in each reading of the paper."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from srbval.bearing import Bearing, Fault
from srbval.comparison.counterpart import SimulationCase
from srbval.models.hierarchy import LEVELS
from srbval.models.run import Run
from srbval.plan.measures import WIDE_BAND_HZ, missing_of
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import recording_from_run
from srbval.scene import LoadPath, RollerFit, paper_scene

HEIGHTS_MM = (0.05, 0.1, 0.2, 0.3)
PAPER_HEIGHT_MM = 0.2
SWEPT_MODEL = "impulse"
SECONDS = 1.0
BY_LEVEL = [(level.name, fit, PAPER_HEIGHT_MM) for level in LEVELS for fit in RollerFit]
BY_HEIGHT = [(SWEPT_MODEL, RollerFit.PLAY, height_mm) for height_mm in HEIGHTS_MM]
PHASES = 40  # of a passage, of which the envelope's mean is taken


def pattern_cases() -> list[SimulationCase]:
    """The runs behind `harmonic_patterns`, each once, and those that `impulse_trains` takes besides."""
    return [
        *(
            _case(_pattern_id(model, fit, height_mm), "which harmonic is missing", model=model,
                  defect={"kind": "outer", "height_m": height_mm / 1e3}, contact={"roller_fit": fit.value})
            for model, fit, height_mm in dict.fromkeys([*BY_LEVEL, *BY_HEIGHT])
        ),
        *(
            _case(_train_id(fit, LoadPath.BEARING), "how clear the impulses are", defect={"kind": "outer"},
                  contact={"roller_fit": fit.value}, load={"path": LoadPath.BEARING.value})
            for fit in RollerFit
        ),
    ]  # fmt: skip


def _case(name: str, purpose: str, **changes: Any) -> SimulationCase:
    scene = paper_scene(duration_s=SECONDS, **changes)
    return SimulationCase(id=name, purpose=purpose, state=Fault.OUTER, scene=scene)


def _pattern_id(model: str, fit: RollerFit, height_mm: float = PAPER_HEIGHT_MM) -> str:
    return f"pattern-{model}-{fit.value}-{height_mm:g}-mm"


def _train_id(fit: RollerFit, path: LoadPath) -> str:
    return _pattern_id("full", fit) if path is LoadPath.HOUSING else f"train-{fit.value}-{path.value}"


def harmonic_patterns(runs: Mapping[str, Run]) -> dict[str, Any]:
    """The missing harmonic by model and roller fit at the paper's bump, and by bump height on one model; bands [Hz].

    Each row has the length of the run's pulse over the distance of two passages, and the missing harmonic of BPFO:
    `by_sinc` is what the pulse's length predicts, the other two are measured in envelope spectra of a wide band and of
    the paper's. Not whole: where between two harmonics the heights pass zero. None: none of the first ten is missing.
    """
    found = {key: _missing(runs[_pattern_id(*key)], *key) for key in dict.fromkeys([*BY_LEVEL, *BY_HEIGHT])}
    return {
        "height_mm": PAPER_HEIGHT_MM,
        "swept_model": SWEPT_MODEL,
        "wide_band_hz": WIDE_BAND_HZ,
        "paper_band_hz": SIMULATED_BAND_HZ,
        "by_rung": [found[key] for key in BY_LEVEL],
        "by_height": [found[key] for key in BY_HEIGHT],
    }


def _missing(run: Run, model: str, fit: RollerFit, height_mm: float) -> dict[str, Any]:
    return {"model": model, "roller_fit": fit.value, "height_mm": height_mm, **missing_of(run)}


def impulse_trains(runs: Mapping[str, Run], bearing: Bearing) -> dict[tuple[RollerFit, LoadPath], Analysis]:
    """Runs of the paper's scene with an outer-race defect in each reading of what the paper leaves open."""
    return {
        (fit, path): analyse(recording_from_run(runs[_train_id(fit, path)]), bearing=bearing)
        for fit in RollerFit
        for path in LoadPath
    }


def clearness(fit: RollerFit, path: LoadPath, analysis: Analysis) -> dict[str, Any]:
    """How clear the train of impulses is in the envelope of the paper's band.

    `contrast` is the largest over the least of the envelope's means by phase of the passage, `scatter_pct` the standard
    deviation of the passages' highest values over their mean; 1 and much for noise.
    """
    envelope, line = analysis.processed.envelope, analysis.line_of(Fault.OUTER)
    passage = np.arange(envelope.size) / analysis.processed.fs_hz * (line.found_hz or line.kinematic_hz)
    phase = (passage % 1 * PHASES).astype(int)
    by_phase = np.bincount(phase, weights=envelope) / np.bincount(phase)
    number = np.floor(passage - by_phase.argmax() / PHASES + 0.5).astype(int)  # cut where the envelope is low
    whole = range(number[0] + 1, number[-1])
    highest = np.array([envelope[number == one].max() for one in whole])
    return {
        "roller_fit": fit.value, "load_path": path.value, "contrast": float(by_phase.max() / by_phase.min()),
        "scatter_pct": 100 * float(highest.std() / highest.mean()), "passages": len(whole),
        "rms_m_s2": float(analysis.processed.filtered.std()) * analysis.processed.scale,
    }  # fmt: skip
