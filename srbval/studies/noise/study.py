"""How detection degrades with added noise.

The fault lines of simulated bearings are read under added noise of stated ratios and spectra. A row is one defect,
noise spectrum and ratio `snr_db`, None without added noise: in how many `draws` the line was found, its median height
over noise, and the largest deviation of a found line from its frequency without noise, None where none was found.
"""

from argparse import Namespace
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.campaign.export import WHITE, NoiseSpectrum, add_noise, noise_spectrum
from srbval.models.simulate import stored_run
from srbval.progress import Progress, silent
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.reading.lines import Line
from srbval.recordings import Recording, recording_from_run
from srbval.scene import paper_scene
from srbval.studies.harness import StudyResult, input_hashes

RATIOS_DB = (20.0, 15.0, 10.0, 5.0, 0.0, -5.0, -10.0)
SECONDS = 2.0
DRAWS = 4  # records with noise of their own for each ratio
NO_NOISE = "none"


def noise_study(
    *,
    noises: Sequence[str] = (WHITE,),
    ratios_db: Sequence[float] = RATIOS_DB,
    seconds: float = SECONDS,
    draws: int = DRAWS,
    progress: Progress = silent,
) -> list[dict[str, Any]]:
    """The paper's scene with each race defect, `seconds` long, under each of the `noises` (see `noise_spectrum`).

    Noise is added to both radial axes, each with the signal-to-noise ratio of `ratios_db` over all frequencies; a draw
    is reproducible by its number. Raises `NumericsError` where a run fails, and what reading a recording raises.
    """
    spectra, rows = [noise_spectrum(noise) for noise in noises], list[dict[str, Any]]()
    for number, fault in enumerate(RACE_DEFECTS):
        progress("detection under noise", number / len(RACE_DEFECTS))
        run = stored_run(paper_scene(defect={"kind": fault}, duration_s=seconds))
        record = recording_from_run(run.require_usable(f"noise study: the {fault} run"))
        clean = _line(record, fault)
        rows.append(_row(fault, clean, [clean], NO_NOISE, None))
        for spectrum in spectra:
            for ratio in ratios_db:
                lines = [_line(noisy, fault) for noisy in _noisy_records(record, spectrum, ratio, draws)]
                rows.append(_row(fault, clean, lines, spectrum.name, ratio))
    progress("detection under noise", 1.0)
    return rows


def _line(record: Recording, fault: Fault) -> Line:
    return analyse(record, bearing=load_bearing(record.bearing or "")).line_of(fault)


def _noisy_records(record: Recording, spectrum: NoiseSpectrum, snr_db: float, draws: int) -> Iterator[Recording]:
    for draw in range(draws):
        random = np.random.default_rng([draw, round(1000 * (snr_db + 1000))])
        channels = {
            axis: add_noise(samples, record.fs_hz, snr_db=snr_db, spectrum=spectrum, random=random)
            for axis, samples in record.channels.items()
        }
        yield replace(record, channels=channels)


def _row(fault: Fault, clean: Line, lines: Sequence[Line], colour: str, snr_db: float | None) -> dict[str, Any]:
    found_hz = [line.found_hz for line in lines if line.detected and line.found_hz is not None]
    off = [100 * abs(hz / clean.found_hz - 1) for hz in found_hz if clean.found_hz]
    return {
        "state": fault.value, "line": fault.line, "colour": colour, "snr_db": snr_db, "draws": len(lines),
        "found": len(found_hz), "line_snr": median(line.snr or 0.0 for line in lines),
        "deviation_pct": max(off, default=None),
    }  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    seconds = options.seconds or SECONDS
    rows = noise_study(noises=options.noise, seconds=seconds, progress=progress)
    inputs = input_hashes(*(Path(noise) for noise in options.noise if noise != WHITE))
    return StudyResult(name="noise", content={"rows": rows, "seconds": seconds}, text=text_rows(rows), inputs=inputs)
