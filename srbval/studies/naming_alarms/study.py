"""False alarms of naming a fault, on records that hold none.

Backgrounds are white, pink and impulsive noise, random tones, gear families with sidebands, tones and noise modulated
by shafts. Counted are how often a fault's chance falls below 0.01, over 0.01, and what is called; and in how many
records a race or roller line is detected, in the declared band and in one chosen on the record.
"""

from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import scipy.signal

from srbval.arrays import FloatArray
from srbval.bearing import load_bearing
from srbval.diagnosis.diagnose import diagnose
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.reading.lines import detected_fault_lines
from srbval.reading.pipeline import process
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource
from srbval.studies.harness import Study, StudyResult

FS_HZ, SECONDS, SHAFT_HZ, LEVEL = 12000.0, 5.0, 29.95, 0.01
BAND_HZ = 500.0, 5500.0
TIME_S = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
Rng = np.random.Generator


def white(rng: Rng) -> FloatArray:
    """White noise."""
    return rng.standard_normal(TIME_S.size)


def pink(rng: Rng) -> FloatArray:
    """Noise whose power falls as 1 / f."""
    lines = np.fft.rfft(white(rng))
    return np.fft.irfft(lines / np.sqrt(np.maximum(np.arange(lines.size), 1)), TIME_S.size)


def impulsive(rng: Rng) -> FloatArray:
    """Knocks at random times on a resonance at 3 kHz, forty per second, in white noise."""
    knocks = np.zeros(TIME_S.size)
    at = rng.integers(0, TIME_S.size, rng.poisson(40 * SECONDS))
    np.add.at(knocks, at, rng.standard_normal(at.size) * rng.exponential(90, at.size))
    return np.asarray(white(rng) + scipy.signal.lfilter(*scipy.signal.iirpeak(3000 / (FS_HZ / 2), 8), knocks))


def tones(rng: Rng) -> FloatArray:
    """Twenty tones anywhere in white noise."""
    return np.asarray(white(rng) + sum(rng.exponential(1.5) * _tone(rng, rng.uniform(100, 5900)) for _ in range(20)))


def gears(rng: Rng) -> FloatArray:
    """Two gear pairs, four mesh harmonics each, with sidebands of their own shafts and of the bearing's."""
    found = white(rng)
    for _ in range(2):
        shaft_hz, teeth = SHAFT_HZ * rng.uniform(0.2, 0.9), rng.integers(17, 60)
        for harmonic in range(1, 5):
            sides = 1 + rng.uniform(0.2, 0.8) * _tone(rng, shaft_hz) + rng.uniform(0, 0.4) * _tone(rng, 2 * shaft_hz)
            sides += rng.uniform(0, 0.5) * _tone(rng, SHAFT_HZ)
            found = found + rng.exponential(1.5) * sides * _tone(rng, harmonic * teeth * shaft_hz)
    return found


def shafts(rng: Rng) -> FloatArray:
    """Noise modulated by the bearing's shaft, and tones modulated by another, five harmonics each."""
    own = 1 + sum(rng.uniform(0, 0.5) / h * _tone(rng, h * SHAFT_HZ) for h in range(1, 6))
    other_hz = SHAFT_HZ * rng.uniform(0.2, 3)
    other = 1 + sum(rng.uniform(0, 0.3) / h * _tone(rng, h * other_hz) for h in range(1, 6))
    return np.asarray(white(rng) * own + sum(rng.exponential(1) * other * _tone(rng, f) for f in (700, 2100, 4300)))


def _tone(rng: Rng, frequency_hz: float) -> FloatArray:
    return np.asarray(np.cos(2 * np.pi * (frequency_hz * TIME_S + rng.random())))


BACKGROUNDS: tuple[Callable[[Rng], FloatArray], ...] = (white, pink, impulsive, tones, gears, shafts)


def alarms(background: Callable[[Rng], FloatArray], count: int, seed: int = 1) -> dict[str, object]:
    """Over `count` records: chances of all faults below `LEVEL`, over it, and how often which class is called."""
    chances, said, detected = list[float](), Counter[str](), Counter[bool]()
    bearing = load_bearing("skf-6205")
    speed = ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.015, source=SpeedSource.STATED)
    first = Recording(
        name=background.__name__, origin=Origin.MEASURED, channels={"x": background(np.random.default_rng(seed))},
        channel="x", fs_hz=FS_HZ, unit="m/s2", speed=speed, band_hz=BAND_HZ,
    )  # fmt: skip
    analysis = analyse(first, bearing=bearing)
    for number in range(count):
        recording = replace(first, channels={"x": background(np.random.default_rng([seed, number]))})
        # The speed is stated and no line has a part in the naming: the chain alone is run again.
        processed = process(recording, band_hz=BAND_HZ, tracking=analysis.processed.tracking)
        naming = diagnose(replace(analysis, recording=recording, processed=processed))
        chances += [part.false_alarm for part in naming.scores.parts if part.false_alarm is not None]
        said[naming.state] += 1
        for choose in (False, True):
            detected[choose] += bool(
                detected_fault_lines(analyse(recording, bearing=bearing, choose_on_record=choose).lines)
            )
    rate = float(np.mean(np.array(chances) < LEVEL))
    faults = sum(said[part.fault.value] for part in naming.scores.parts)
    return {
        "background": background.__name__, "chances": len(chances), "below": rate, "over nominal": rate / LEVEL,
        "records": count, "fault called": faults, "something else": said["other"],
        "line detected": detected[False], "the same, band chosen": detected[True],
    }  # fmt: skip


def _options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--records",
        metavar="N",
        type="count",
        default=334,
        help="of each background (default: 334)",
    )


def _run(options: Namespace, _: Progress) -> StudyResult:
    with ProcessPoolExecutor(options.jobs) as pool:
        rows = list(pool.map(partial(alarms, count=options.records), BACKGROUNDS))
    return StudyResult(name="naming_alarms", content={"records": options.records, "rows": rows}, text=text_rows(rows))


STUDY = Study(question="How often is a fault named on records that hold none?", minutes=4, run=_run, options=_options)
