"""Where rollers pass the outer-race hole, passage by passage: in the rig's records, and with pockets that differ.

What pockets do repeats every turn of the cage, each slot having a place of its own. One swing a turn, alike in
neighbouring slots, is no pocket's: the shaft's speed does it, and a tachometer that follows late. So every record is
read twice, at even angles by its tachometer and at even times.
"""

import math
from argparse import Namespace
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import Fault
from srbval.comparison.compared_quantities import harmonic_level
from srbval.comparison.speed_and_slip import published_rpm
from srbval.models.hierarchy import geometry_of
from srbval.models.simulate import stored_run
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings import Recording, recording_from_run
from srbval.scene import load_scene
from srbval.studies.harness import StudyResult, input_hashes
from srbval.studies.rig_amplitudes import BEARING, measured, measured_entry

SLOTS = BEARING.rolling_elements
BAND_HZ, RPM, OFFSETS_M = (400.0, 3150.0), (353.0, 877.0), (0.0, 1e-4, 3e-4)
HARMONICS, SAMPLES, ROUNDS = np.arange(1, 13), 256, 10  # of a passage; until its mean shape is aligned
LAGS = np.linspace(-0.06, 0.06, 481)  # of a passage: 3 mm either way


def passages(squared: FloatArray, per_passage: float) -> tuple[FloatArray, FloatArray]:
    """When each passage comes, as a share of their spacing, [k], and coherence of its harmonics, [12].

    The lag at which its harmonics fit the mean of all best, without the slow course. Coherence: the share of a
    harmonic's power that is in its mean over passages. `squared`: envelope with so many samples a passage.
    """
    number = np.arange(int((len(squared) - 1) / per_passage))
    at = np.arange(number.size * SAMPLES) * per_passage / SAMPLES
    rows = np.interp(at, np.arange(len(squared)), squared).reshape(-1, SAMPLES)
    lines, lag = np.fft.rfft(rows)[:, HARMONICS], np.zeros(number.size)
    for _ in range(ROUNDS):
        shape = (lines * np.exp(2j * np.pi * np.outer(lag, HARMONICS))).mean(axis=0)
        lag = LAGS[np.real(np.exp(2j * np.pi * np.outer(LAGS, HARMONICS)) @ (lines * shape.conj()).T).argmax(axis=0)]
    coherence = np.abs(lines.mean(axis=0)) ** 2 / (np.abs(lines) ** 2).mean(axis=0)
    return lag - np.polyval(np.polyfit(number, lag, 2), number), coherence


def repeats(places: FloatArray) -> dict[str, float]:
    """Scatter of `places`, one a passage, and how alike the next slot's and the next turn's are.

    Then the swing once a turn of the cage, and of what is left the scatter, the likeness a turn later, and the slots'
    means beside what chance gives them.
    """
    turn = 2 * np.pi * np.arange(len(places)) / SLOTS
    fitted, *_ = np.linalg.lstsq(np.stack([np.cos(turn), np.sin(turn)], axis=1), places, rcond=None)
    left = places - fitted @ [np.cos(turn), np.sin(turn)]
    alike = [float(np.mean(x[:-n] * x[n:]) / np.mean(x**2)) for x, n in ((places, 1), (places, SLOTS), (left, SLOTS))]
    return {
        "sd": float(places.std()), "next_slot": alike[0], "next_turn": alike[1],
        "once_a_turn": float(math.hypot(*fitted)), "left_sd": float(left.std()), "left_next_turn": alike[2],
        "slots_sd": float(np.std([left[slot::SLOTS].mean() for slot in range(SLOTS)])),
        "by_chance": float(left.std() / math.sqrt(len(places) / SLOTS)),
    }  # fmt: skip


def row(side: str, record: Recording) -> dict[str, Any]:
    """Of a record of the hole: `repeats` in mm along the race, coherence, squared-envelope levels over BPFO's."""
    found, geometry = analyse(record, bearing=BEARING, band_hz=BAND_HZ), geometry_of(BEARING)
    squared, rate = found.processed.squared, (found.line("BPFO").found_hz or math.nan) / found.processed.squared_fs_hz
    lag, coherence = passages(squared, 1 / rate)
    spacing_mm = 2e3 * math.pi * geometry.raceway_radius_m * math.cos(geometry.tilt_rad) / SLOTS
    waves = np.exp(-2j * np.pi * np.outer([rate, rate / SLOTS], np.arange(len(squared))))
    line, cage = np.abs(waves @ (np.hanning(len(squared)) * (squared - squared.mean())))
    levels = {number: harmonic_level(number)(found, Fault.OUTER) for number in (2, 3, 5)}
    return {
        "side": side, "rpm": 60 * found.speed.value_hz, **repeats(spacing_mm * lag),
        **{f"coherence_{number}": float(coherence[number - 1]) for number in (1, 5, 10)},
        **{f"harmonic_{number}_db": level and level.value for number, level in levels.items()},
        "ftf_db": 20 * math.log10(cage / line),
    }  # fmt: skip


def sides() -> Iterator[tuple[str, Recording]]:
    """The rig's records, at even angles and at even times, and the scene `rig` with `OFFSETS_M` at their speeds."""
    for rpm in RPM:
        record = measured(Fault.OUTER, rpm)
        yield "rig, even angles", record
        yield "rig, even times", replace(record, speed_signal=None)
        for offset in OFFSETS_M:
            own = {"defect": {"kind": "outer"}, "bodies": {"pocket_offset_m": offset},
                   "shaft_speed": f"{published_rpm(Fault.OUTER, rpm)[0]} rpm"}  # fmt: skip
            yield f"scene rig, {1e3 * offset:g} mm", recording_from_run(stored_run(load_scene("rig", own)))


def run(_: Namespace, __: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    found = [row(*one) for one in sides()]
    inputs = input_hashes(*(measured_entry(Fault.OUTER, rpm) for rpm in RPM))
    return StudyResult(name="cage_pockets", content={"rows": found}, text=text_rows(found), inputs=inputs)
