"""How detection falls with noise: fault lines of simulated bearings read under noise of stated ratio and colour."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from statistics import median
from typing import Any

import numpy as np

from srbval.bearing import RACE_DEFECTS, Fault, load_bearing
from srbval.campaign.noise import WHITE, Colour, add_noise, colour_of
from srbval.errors import NumericsError
from srbval.models.run import RunStatus
from srbval.models.simulate import simulate
from srbval.progress import Progress, silent
from srbval.recordings.from_run import recording_from_run
from srbval.recordings.recording import Recording
from srbval.scene import paper_scene
from srbval.validation.analyse import analyse

RATIOS_DB = (20.0, 15.0, 10.0, 5.0, 0.0, -5.0, -10.0)
SECONDS = 2.0
DRAWS = 4


@dataclass(frozen=True, kw_only=True)
class NoiseRow:
    """One state, colour and ratio over all `draws`: how many found the line, its middle height over the noise.

    `deviation_pct` is the largest distance of a found line from where it stands without noise; None where none was
    found. `snr_db` is None without noise.
    """

    state: str
    line: str
    colour: str
    snr_db: float | None
    draws: int
    found: int
    line_snr: float | None
    deviation_pct: float | None

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)


def noise_study(
    *,
    noises: Sequence[str] = (WHITE,),
    ratios_db: Sequence[float] = RATIOS_DB,
    seconds: float = SECONDS,
    draws: int = DRAWS,
    progress: Progress = silent,
) -> list[NoiseRow]:
    """The paper's scene with each race defect, `seconds` long, under each of the `noises` (see `colour_of`).

    Noise goes on both radial axes, as strong as `ratios_db` say against each one's signal over all frequencies; a draw
    repeats with its number. Raises `NumericsError` where a run fails, and what reading a recording raises.
    """
    colours = [colour_of(noise) for noise in noises]
    rows: list[NoiseRow] = []
    for number, fault in enumerate(RACE_DEFECTS):
        record = _record(fault, seconds)
        bare = _row(record, fault, None, None, [0])
        rows.append(bare)
        for part, colour in enumerate(colours):
            for step, ratio in enumerate(ratios_db):
                share = (number + (part + step / len(ratios_db)) / len(colours)) / len(RACE_DEFECTS)
                progress("detection under noise", share)
                rows.append(_row(record, fault, colour, ratio, range(draws)))
    progress("detection under noise", 1.0)
    return rows


def _record(fault: Fault, seconds: float) -> Recording:
    run = simulate(paper_scene(defect={"kind": fault}, duration_s=seconds))
    if run.status is not RunStatus.OK:
        raise NumericsError(f"noise study: the {fault} run failed ({run.status}): {run.reason}")
    return recording_from_run(run)


def _row(
    record: Recording, fault: Fault, colour: Colour | None, snr_db: float | None, draws: Sequence[int]
) -> NoiseRow:
    true_hz = analyse(record, bearing=load_bearing(record.bearing or "")).line_of(fault).found_hz
    heights, found_hz = [], []
    for line in _lines(record, fault, colour, snr_db, draws):
        heights.append(line.snr or 0.0)
        if line.detected and line.found_hz is not None:
            found_hz.append(line.found_hz)
    return NoiseRow(
        state=record.state.value if record.state else "",
        line=fault.line or "",
        colour=colour.name if colour else "none",
        snr_db=snr_db,
        draws=len(heights),
        found=len(found_hz),
        line_snr=median(heights),
        deviation_pct=max((100 * abs(f / true_hz - 1) for f in found_hz), default=None) if true_hz else None,
    )


def _lines(
    record: Recording, fault: Fault, colour: Colour | None, snr_db: float | None, draws: Sequence[int]
) -> Iterator[Any]:
    for draw in draws:
        noisy = record
        if colour is not None and snr_db is not None:
            random = np.random.default_rng([draw, round(1000 * (snr_db + 1000))])
            channels = {
                axis: add_noise(samples, record.fs_hz, snr_db=snr_db, colour=colour, random=random)
                for axis, samples in record.channels.items()
            }
            noisy = replace(record, channels=channels)
        yield analyse(noisy, bearing=load_bearing(record.bearing or "")).line_of(fault)
