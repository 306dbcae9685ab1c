"""Which harmonic of BPFO is missing, on every rung of the ladder and over the height of the bump."""

from collections.abc import Mapping
from dataclasses import dataclass

from srbval.bearing import Fault
from srbval.comparison.counterpart import SimulationCase
from srbval.models.ladder import RUNGS
from srbval.models.run import Run
from srbval.plan.pattern import WIDE_BAND_HZ, missing_of
from srbval.progress import Progress, silent
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.scene import RollerFit, paper_scene

HEIGHTS_MM = (0.05, 0.1, 0.2, 0.3)
PAPER_HEIGHT_MM = 0.2
SWEPT_MODEL = "impulse"
SECONDS = 1.0


@dataclass(frozen=True, kw_only=True)
class HarmonicPattern:
    """One run: the length of its pulse over the distance of two passages, and the missing harmonic of BPFO.

    `by_sinc` is what the pulse's length predicts, the other two are measured in envelope spectra of a wide band and of
    the paper's. Not whole: where between two harmonics the heights pass zero. None: none of the first ten is missing.
    """

    model: str
    roller_fit: str
    height_mm: float
    pulse_share: float
    by_sinc: float
    wide_band: float | None
    paper_band: float | None


@dataclass(frozen=True, kw_only=True)
class HarmonicPatterns:
    """The missing harmonic by rung and roller fit at the paper's bump, and by bump height on one rung; bands [Hz]."""

    height_mm: float
    swept_model: str
    wide_band_hz: tuple[float, float]
    paper_band_hz: tuple[float, float]
    by_rung: tuple[HarmonicPattern, ...]
    by_height: tuple[HarmonicPattern, ...]


def pattern_cases() -> list[SimulationCase]:
    """The runs that it takes, each once."""
    wanted = dict.fromkeys([*_rungs(), *_heights()])
    return [
        SimulationCase(
            id=pattern_id(model, fit, height_mm),
            purpose="which harmonic is missing",
            state=Fault.OUTER,
            scene=paper_scene(
                model=model, duration_s=SECONDS, defect={"kind": "outer", "height_m": height_mm / 1e3},
                contact={"roller_fit": fit.value},
            ),
        )
        for model, fit, height_mm in wanted
    ]  # fmt: skip


def harmonic_patterns(runs: Mapping[str, Run], progress: Progress = silent) -> HarmonicPatterns:
    """The missing harmonic of each of the `pattern_cases`, by their ids."""
    keys = dict.fromkeys([*_rungs(), *_heights()])
    found = {}
    for number, key in enumerate(keys):
        progress("Look for missing harmonics", number / len(keys))
        found[key] = _missing(runs[pattern_id(*key)], *key)
    progress("Look for missing harmonics", 1.0)
    return HarmonicPatterns(
        height_mm=PAPER_HEIGHT_MM,
        swept_model=SWEPT_MODEL,
        wide_band_hz=WIDE_BAND_HZ,
        paper_band_hz=SIMULATED_BAND_HZ,
        by_rung=tuple(found[key] for key in _rungs()),
        by_height=tuple(found[key] for key in _heights()),
    )


def _rungs() -> list[tuple[str, RollerFit, float]]:
    return [(rung.name, fit, PAPER_HEIGHT_MM) for rung in RUNGS for fit in RollerFit]


def _heights() -> list[tuple[str, RollerFit, float]]:
    return [(SWEPT_MODEL, RollerFit.PLAY, height_mm) for height_mm in HEIGHTS_MM]


def pattern_id(model: str, fit: RollerFit, height_mm: float = PAPER_HEIGHT_MM) -> str:
    """The id of a case."""
    return f"pattern-{model}-{fit.value}-{height_mm:g}-mm"


def _missing(run: Run, model: str, fit: RollerFit, height_mm: float) -> HarmonicPattern:
    missing = missing_of(run)
    return HarmonicPattern(
        model=model,
        roller_fit=fit.value,
        height_mm=height_mm,
        pulse_share=missing.pulse.share,
        by_sinc=missing.by_sinc,
        wide_band=missing.wide_band,
        paper_band=missing.paper_band,
    )
