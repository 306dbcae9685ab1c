"""What the paper's Figures 11c, 12 and 14c show in each reading of what it leaves open, and on each model.

A rectangular pulse of length tau, repeated at f, lacks its harmonic 1 / (f tau) (the paper's eq. 20): it lays the
missing harmonic of Figure 12 to that. Measured on envelope spectra the missing one is found where the heights change
sign. How clear the impulses of Figures 11c and 14c are follows from the envelope by phase of the passage.
"""

import math
from argparse import Namespace
from collections.abc import Sequence
from typing import Any

import numpy as np

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.comparison.counterpart import SimulationCase, run_cases
from srbval.errors import ConfigurationError
from srbval.models.hierarchy import LEVELS
from srbval.models.planar import ring_kernel
from srbval.models.planar.ring import make_ring
from srbval.models.run import Run
from srbval.plan.measures import harmonic_pattern
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import SIMULATED_BAND_HZ
from srbval.recordings import recording_from_run
from srbval.scene import LoadPath, RollerFit, Scene, paper_scene
from srbval.studies.harness import StudyResult

HEIGHTS_MM = (0.05, 0.1, 0.2, 0.3)
PAPER_HEIGHT_MM = 0.2
SWEPT_MODEL = "impulse"
SECONDS = 1.0
BY_LEVEL = [(level.name, fit, PAPER_HEIGHT_MM) for level in LEVELS for fit in RollerFit]
BY_HEIGHT = [(SWEPT_MODEL, RollerFit.PLAY, height_mm) for height_mm in HEIGHTS_MM]
READINGS = [(fit, path) for fit in RollerFit for path in LoadPath]
PHASES = 40  # of a passage, of which the envelope's mean is taken
PULSE_HARMONICS = 10
FELT = 0.01  # of a pulse's height: where it begins and ends
WIDE_BAND_HZ = (300.0, 3300.0)  # preserves a pulse's shape: more than ten times BPFO on either side of its middle


def _case(model: str, fit: RollerFit, height_mm: float, path: LoadPath = LoadPath.HOUSING) -> SimulationCase:
    scene = paper_scene(
        model=model, duration_s=SECONDS, defect={"kind": "outer", "height_m": height_mm / 1e3},
        contact={"roller_fit": fit.value}, load={"path": path.value},
    )  # fmt: skip
    name = f"{model}-{fit.value}-{height_mm:g}-mm-{path.value}"
    return SimulationCase(id=name, purpose="the paper's figures", state=Fault.OUTER, scene=scene)


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    patterns = dict.fromkeys([*BY_LEVEL, *BY_HEIGHT])
    trains = {(fit, path): _case("full", fit, PAPER_HEIGHT_MM, path) for fit, path in READINGS}
    cases = {case.id: case for case in (*(_case(*key) for key in patterns), *trains.values())}
    runs = run_cases(list(cases.values()), jobs=options.jobs, progress=progress)
    found = {key: missing_of(runs[_case(*key).id]) for key in patterns}
    rows = {key: {"model": key[0], "roller_fit": key[1], "height_mm": key[2], **own} for key, own in found.items()}
    bearing = load_bearing(cases[trains[READINGS[0]].id].scene.bearing)
    clear = [
        {"roller_fit": fit, "load_path": path} | clearness(analyse(recording_from_run(runs[case.id]), bearing=bearing))
        for (fit, path), case in trains.items()
    ]
    content: dict[str, Any] = {
        "height_mm": PAPER_HEIGHT_MM, "swept_model": SWEPT_MODEL, "wide_band_hz": WIDE_BAND_HZ,
        "paper_band_hz": SIMULATED_BAND_HZ, "by_model": [rows[key] for key in BY_LEVEL],
        "by_height": [rows[key] for key in BY_HEIGHT], "impulse_trains": clear,
    }  # fmt: skip
    text = "\n\n".join(text_rows(content[name]) for name in ("by_model", "by_height", "impulse_trains"))
    return StudyResult(name="paper_figures", content=content, text=text)


def clearness(analysis: Analysis) -> dict[str, float]:
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
        "contrast": float(by_phase.max() / by_phase.min()),
        "scatter_pct": 100 * float(highest.std() / highest.mean()), "passages": len(whole),
        "rms_m_s2": float(analysis.processed.filtered.std()) * analysis.processed.scale,
    }  # fmt: skip


def pulse_share(scene: Scene) -> float:
    """Pulse length over the passing period, f tau of the paper's eq. (20): the same at every speed.

    The force pulse is that of the scene's first defect under a roller in the middle of the load zone, the ring held,
    from where it is first felt to where it is last. `ConfigurationError` for a defect that is on no race.
    """
    if scene.defect.kind not in RACE_DEFECTS:
        raise ConfigurationError(f"defect {scene.defect.kind.scene_word}: only a race's defect has a pulse length.")
    ring = make_ring(scene, load_bearing(scene.bearing))
    kernel, zone = ring.kernel, np.array([math.cos(scene.load.zone_rad), math.sin(scene.load.zone_rad)])
    pulse = kernel.bumps[0, round((-float(ring.balance_m() @ zone) - kernel.bump_start) / kernel.bump_step)]
    felt = np.flatnonzero(pulse > FELT * pulse.max())
    length_m = 2 * float(felt[-1]) * float(kernel.defects[0, ring_kernel.POSITION_STEP])
    return length_m / (2 * math.pi * float(kernel.defects[0, ring_kernel.RACE_RADIUS]) / kernel.rollers)


def missing_of(run: Run) -> dict[str, float | None]:
    """The harmonic that a usable run with a race's defect lacks: `by_sinc` of its `pulse_share`, and as measured.

    `wide_band` and `paper_band`: a fraction where the heights pass zero between two harmonics, None where none of the
    first `PULSE_HARMONICS` is missing.
    """
    share = pulse_share(run.scene)
    bands = {"wide_band": WIDE_BAND_HZ, "paper_band": SIMULATED_BAND_HZ}
    measured = {name: missing_harmonic(harmonic_heights(run, band_hz)) for name, band_hz in bands.items()}
    return {"pulse_share": share, "by_sinc": 1 / share, **measured}


def harmonic_heights(run: Run, band_hz: tuple[float, float]) -> list[float]:
    """Heights of the first `PULSE_HARMONICS` of the run's fault line, demodulated from a band, over the first one's."""
    bearing = load_bearing(run.scene.bearing)
    found = analyse(recording_from_run(run), bearing=bearing, band_hz=band_hz)
    line = found.line_of(run.scene.defect.kind)
    first = line.found_hz if line.found_hz is not None else line.kinematic_hz
    return list(harmonic_pattern(found.processed.envelope, found.processed.fs_hz, first, PULSE_HARMONICS))


def missing_harmonic(heights: Sequence[float]) -> float | None:
    """Where the first lobe of a harmonic pattern ends: the first local minimum, or between it and a neighbour.

    Heights are moduli, so a lobe that passes zero turns up again behind it; the change of sign is put where the slopes
    on both sides agree best.
    """
    for i in range(1, len(heights) - 1):
        before, here, after = heights[i - 1], heights[i], heights[i + 1]
        if here > before or here > after:
            continue
        behind = abs((before - here) - (here + after))  # passes zero behind this one
        ahead = abs((before + here) - (after - here))  # passed it ahead of this one
        if behind <= ahead:
            return i + 1 + here / (here + after)
        return i + before / (before + here)
    return None
