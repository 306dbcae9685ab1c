"""False alarms: placebo probabilities on healthy records, and faults named on records that hold none.

Placebos: combs at meaningless orders of healthy records are ranked as a family would be: their ranks must be uniform.
Whatever was chosen in the design, that is from how many fundamentals a placebo's lines come, is chosen again for each
rig on the others alone. The combs of one rig are not independent: a record holds some tens whose windows are apart.
So beside a rig's distance from uniform stands what the same number of combs give by chance: ``--noise N`` prints it,
from N white noises in the place of each record.

Backgrounds: white, pink and impulsive noise, random tones, gear families with sidebands, tones and noise modulated by
shafts, another bearing's impacts, bursts of noise at a rate of their own, mains and a belt. On each, and on its
beginnings, combs at meaningless orders are read: how often the probability that a line states falls below 0.01.

Naming: counted are how often a fault's chance falls below 0.01 on these, over 0.01, and what is called; and in how many
records a race or roller line is detected, in the declared band and in one chosen on the record.
"""

import dataclasses
import itertools
import math
import os
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.signal
from scipy import stats

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Fault, load_bearing
from srbval.diagnosis.diagnose import diagnose
from srbval.errors import DataError
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.families import Family, families_of, half_window_hz, placebo_fundamentals
from srbval.reading.lines import detected_fault_lines
from srbval.reading.pipeline import periodogram_of, process
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource, load_recording
from srbval.signal import Periodogram, read_comb
from srbval.signal.false_alarm import APART, GRID, ORDERS, PlaceboRank, joint_false_alarm, rank_among_placebos
from srbval.studies.harness import StudyResult, input_hashes

IMS = ("2003.10.22.12.06.24", "2003.10.22.12.09.13", "2003.10.22.12.14.13")
# Rig, file, channel and bearing of every healthy record; IMS: the first hours of a run to failure, four bearings.
HEALTHY: tuple[tuple[str, str, str | None, str], ...] = (
    ("cwru", "cwru/97_Normal_0_48kDE.mat", None, "skf-6205"),
    ("hit-sm self-built", "hit_sm/Self-built/Normal_1200.mat", None, "skf-6205"),
    ("hit-sm spectraquest", "hit_sm/SpectraQuest/Normal_1200.mat", None, "skf-6205"),
    ("uestc", "uestc/N_1200_1.mat", None, "uc-204"),
    *(("ims", f"ims_test1/{name}", f"ch{n}", "rexnord-za-2115") for name in IMS for n in range(1, 9)),
    ("torino", "torino/H_353rpm_sample.mat", None, "skf-22240"),
    ("torino", "torino/H_877rpm_sample.mat", None, "skf-22240"),
)
COMBS_PER_FAMILY, RECORDS, SEED = 40, 334, 1
LEVELS = (0.005, 0.01, 0.02, 0.05)
# Fundamentals that a placebo's lines come from, the design's own first. One: a whole comb; five: each line by itself.
DESIGNS = (ORDERS, 1, 3, 5)
# Of records that hold no fault.
FS_HZ, SECONDS, SHAFT_HZ, LEVEL = 12000.0, 5.0, 29.95, 0.01
BAND_HZ = 500.0, 5500.0
# Lengths of the records whose placebo lines are read, and how many of the records and of the combs of each family.
LENGTHS_S, PLACEBO_RECORDS, PLACEBO_COMBS = (1.0, 2.0, SECONDS), 100, 6
TIME_S = np.arange(round(FS_HZ * SECONDS)) / FS_HZ
Rng = np.random.Generator
Row = dict[str, Any]


def tried_combs(rig: str, analysis: Analysis, designs: Sequence[int], count: int) -> Iterator[Row]:
    """`count` combs about each race and roller family of a healthy record, each read as a family would be.

    `placebo` probability in each of the designs, and that of `noise` only; `before`: detected by the latter. `share` of
    an independent comb: windows that do not overlap, over combs drawn.
    """
    bearing, speed = analysis.bearing, analysis.speed
    record = periodogram_of(analysis.processed, bearing, speed)
    families = families_of(bearing, speed.value_hz)
    rng = np.random.default_rng(SEED)
    for family in families[: len(DEFECTS)]:
        half_hz = half_window_hz(family.kinematic_hz, record, bearing.largest_slip)
        about = read_comb(record, family.kinematic_hz, half_hz, period_s=None)
        if about is None:
            continue
        relative, harmonics = half_hz / family.kinematic_hz, len(about.snr)
        pool = placebo_fundamentals(family, about, record, families, speed)
        for centre in rng.choice(pool, count) if pool.size else ():
            alike = dataclasses.replace(family, kinematic_hz=float(centre))
            ranks = [_rank(record, alike, relative, harmonics, pool, orders) for orders in designs]
            placebo = [math.nan if one is None else one.false_alarm for one in ranks]
            reading = read_comb(record, alike.kinematic_hz, relative * centre, harmonics=harmonics, period_s=None)
            if reading is not None and (first := ranks[0]) is not None:
                stated = joint_false_alarm(reading.noise_false_alarm, first.false_alarm, first.whole_false_alarm)
                yield {
                    "rig": rig, "placebo": placebo, "noise": reading.noise_false_alarm, "before": reading.detected,
                    "whole": first.whole_false_alarm, "stated": stated,
                    "share": min(1.0, pool.size / (2 * GRID * count)),
                }  # fmt: skip


def _rank(
    record: Periodogram, family: Family, relative: float, harmonics: int, pool: FloatArray, orders: int
) -> PlaceboRank | None:
    """As a family there would be ranked: its own surroundings are not meaningless."""
    centre = family.kinematic_hz
    apart = pool[np.abs(pool / centre - 1) >= APART * relative]
    return rank_among_placebos(record, centre, relative * centre, harmonics, apart, orders=orders)


def by_chance(analyses: Sequence[tuple[str, Analysis]], repeats: int, count: int) -> Iterator[Row]:
    """Per rig the distance from uniform that noise gives, in `repeats` trials of `count` combs per family.

    White noise stands in the place of each squared envelope: whatever is not uniform there is chance.
    """

    def noise(analysis: Analysis, seed: int) -> Analysis:
        squared = 3 + np.random.default_rng(seed).standard_normal(analysis.processed.squared.size)
        return dataclasses.replace(analysis, processed=dataclasses.replace(analysis.processed, squared=squared))

    for rig in dict.fromkeys(rig for rig, _ in analyses):
        own = [analysis for name, analysis in analyses if name == rig]
        distances = [
            distance([t["placebo"][0] for a in own for t in tried_combs(rig, noise(a, seed), (ORDERS,), count)])
            for seed in range(repeats)
        ]
        yield {"rig": rig, "median": float(np.median(distances)), "highest": max(distances), "trials": repeats}


def distance(chances: Sequence[float] | FloatArray) -> float:
    """Kolmogorov-Smirnov distance of `chances` from the uniform distribution."""
    return float(stats.kstest(chances, "uniform").statistic)


def _row(name: str, chances: Sequence[float]) -> Row:
    values = np.array([c for c in chances if not math.isnan(c)])
    rates = {f"below {level}": float(np.mean(values < level)) for level in (0.001, 0.01, 0.05)}
    return {"of": name, "combs": values.size, "distance": distance(values), **rates}


def left_out(tried: Sequence[Row]) -> list[tuple[str, int, list[float]]]:
    """Per rig the design whose rate below 0.01 is nearest to that on all other rigs, and the ranks it gives here."""
    chosen = []
    for rig in dict.fromkeys(t["rig"] for t in tried):
        others = np.array([t["placebo"] for t in tried if t["rig"] != rig])
        rates = np.maximum(np.nanmean(np.where(np.isnan(others), np.nan, others < 0.01), axis=0), 1e-4)
        best = int(np.argmin(np.abs(np.log(rates / 0.01))))
        chosen.append((rig, best, [t["placebo"][best] for t in tried if t["rig"] == rig]))
    return chosen


def placebos(tried: Sequence[Row]) -> dict[str, list[Row]]:
    """How uniform the ranks are: by design, by rig, by design chosen on the other rigs; what both rules detect.

    "distance by chance" is what one time in twenty exceeds.
    """
    of_rig = {rig: [t for t in tried if t["rig"] == rig] for rig in dict.fromkeys(t["rig"] for t in tried)}
    independent = {rig: round(sum(t["share"] for t in own)) for rig, own in of_rig.items()}
    folds = left_out(tried)
    noise, ranks = np.array([t["before"] for t in tried]), np.array([t["placebo"][0] for t in tried])
    return {
        "combs": [
            _row("noise only", [t["noise"] for t in tried]),
            *(_row(f"{d} fundamentals", [t["placebo"][n] for t in tried]) for n, d in enumerate(DESIGNS)),
        ],
        "by_rig": [
            _row(rig, [t["placebo"][0] for t in own])
            | {"independent": independent[rig], "distance by chance": 1.36 / math.sqrt(max(independent[rig], 1))}
            for rig, own in of_rig.items()
        ],
        "design_chosen_on_the_others": [
            *(_row(f"{rig}: {DESIGNS[n]} fundamentals", p) for rig, n, p in folds),
            _row("all", [x for *_, p in folds for x in p]),
        ],
        "detected": [
            {"noise only": float(np.mean(noise))}
            | {f"ranks below {level}": float(np.mean(noise & (ranks < level))) for level in LEVELS}
        ],
    }


def healthy(folder: Path) -> Iterator[tuple[Path, str, Analysis]]:
    """File, rig and analysis of those of `HEALTHY` that are there."""
    for rig, name, channel, bearing in HEALTHY:
        if (folder / name).is_file():
            recording = dataclasses.replace(load_recording(folder / name, channel=channel), state=Fault.HEALTHY)
            yield folder / name, rig, analyse(recording, bearing=load_bearing(bearing))


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


def foreign(rng: Rng) -> FloatArray:
    """Impacts of another bearing, their spacing jittered by one per cent, on a resonance in white noise."""
    hz = rng.uniform(2, 9) * SHAFT_HZ * rng.uniform(0.3, 1.7)
    at_s = np.cumsum(1 + 0.01 * rng.standard_normal(round(1.2 * SECONDS * hz))) / hz
    at_s, impacts = at_s[at_s < SECONDS], np.zeros(TIME_S.size)
    np.add.at(impacts, (at_s * FS_HZ).astype(int), rng.uniform(3, 20) * (1 + 0.2 * rng.standard_normal(at_s.size)))
    resonance = scipy.signal.iirpeak(rng.uniform(1500, 5000) / (FS_HZ / 2), 8)
    return np.asarray(white(rng) + scipy.signal.lfilter(*resonance, impacts))


def bursts(rng: Rng) -> FloatArray:
    """Cyclostationary noise: its power rises and falls at a rate from 5 to 150 Hz, over white noise."""
    rise = np.exp(rng.uniform(0.3, 2) * _tone(rng, rng.uniform(5, 150)))
    return np.asarray(white(rng) * rise / rise.mean() + 0.5 * white(rng))


def mains(rng: Rng) -> FloatArray:
    """Harmonics of the mains, over noise that a belt modulates at eight multiples of its own rate: several combs."""
    belt_hz = rng.uniform(4, 14)
    belt = 1 + sum(rng.uniform(0, 0.5) / h * _tone(rng, h * belt_hz) for h in range(1, 9))
    return np.asarray(white(rng) * belt + sum(rng.exponential(1) * _tone(rng, 50 * h) for h in range(1, 30)))


BACKGROUNDS: tuple[Callable[[Rng], FloatArray], ...] = (
    white, pink, impulsive, tones, gears, shafts, foreign, bursts, mains
)  # fmt: skip


def _background_record(background: Callable[[Rng], FloatArray], seed: int | Sequence[int], seconds: float) -> Recording:
    samples = background(np.random.default_rng(seed))[: round(seconds * FS_HZ)]
    return Recording(
        name=background.__name__, origin=Origin.MEASURED, channels={"x": samples}, channel="x", fs_hz=FS_HZ,
        unit="m/s2", band_hz=BAND_HZ,
        speed=ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=0.015, source=SpeedSource.STATED),
    )  # fmt: skip


def placebo_lines(background: Callable[[Rng], FloatArray], count: int, seed: int = 3) -> list[Row]:
    """For each of `LENGTHS_S`: shares of the placebo lines in `count` records whose probabilities are below `LEVEL`.

    Those that noise, mixed placebos and whole combs give by themselves, and `stated`, that of a line.
    """
    bearing, rows = load_bearing("skf-6205"), list[Row]()
    for seconds in LENGTHS_S:
        records = [_background_record(background, (seed, number), seconds) for number in range(count)]
        analysis, tried = analyse(records[0], bearing=bearing), list[Row]()
        for record in records:  # of an analysis the chain alone has a part in the placebos
            processed = process(record, band_hz=BAND_HZ, tracking=analysis.processed.tracking)
            own = dataclasses.replace(analysis, recording=record, processed=processed)
            tried += tried_combs(background.__name__, own, (ORDERS,), PLACEBO_COMBS)
        below = {
            name: float(
                np.mean([(t["placebo"][0] if name == "mixed" else t[name]) < LEVEL for t in tried] or [math.nan])
            )
            for name in ("noise", "mixed", "whole", "stated")
        }
        rows.append({"background": background.__name__, "turns": seconds * SHAFT_HZ, "lines": len(tried)} | below)
    return rows


def of_all_kinds(rows: Sequence[Row]) -> list[Row]:
    """Of each length the mean over all kinds of background, each kind counted once."""
    return [
        {"background": "all kinds", "turns": turns, "lines": sum(r["lines"] for r in own)}
        | {name: float(np.mean([r[name] for r in own])) for name in ("noise", "mixed", "whole", "stated")}
        for turns in dict.fromkeys(r["turns"] for r in rows) if (own := [r for r in rows if r["turns"] == turns])
    ]  # fmt: skip


def alarms(background: Callable[[Rng], FloatArray], count: int, seed: int = 1) -> Row:
    """Over `count` records: chances of all faults below `LEVEL`, over it, and how often which class is called."""
    chances, said, detected = list[float](), Counter[str](), Counter[bool]()
    first = _background_record(background, seed, SECONDS)
    analysis = analyse(first, bearing=load_bearing("skf-6205"))
    for number in range(count):
        recording = dataclasses.replace(first, channels={"x": background(np.random.default_rng([seed, number]))})
        # The speed is stated and no line has a part in the naming: the chain alone is run again.
        processed = process(recording, band_hz=BAND_HZ, tracking=analysis.processed.tracking)
        naming = diagnose(dataclasses.replace(analysis, recording=recording, processed=processed))
        chances += [part.false_alarm for part in naming.scores.parts if part.false_alarm is not None]
        said[naming.state] += 1
        for choose in (False, True):
            read = analyse(recording, bearing=analysis.bearing, choose_on_record=choose)
            detected[choose] += bool(detected_fault_lines(read.lines))
    rate = float(np.mean(np.array(chances) < LEVEL))
    return {
        "background": background.__name__, "chances": len(chances), "below": rate, "over nominal": rate / LEVEL,
        "records": count, "fault called": sum(said[fault.value] for fault in DEFECTS), "something else": said["other"],
        "line detected": detected[False], "the same, band chosen": detected[True],
    }  # fmt: skip


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    combs, records = options.combs or COMBS_PER_FAMILY, options.records or RECORDS
    folder = os.environ.get("SRBVAL_RECORDINGS")
    if not folder:
        raise DataError("SRBVAL_RECORDINGS names no folder of recordings; this study reads those of known data sets.")
    files, analyses = list[Path](), list[tuple[str, Analysis]]()
    for file, rig, analysis in healthy(Path(folder)):
        files.append(file)
        analyses.append((rig, analysis))
    if options.noise:
        rows = list(by_chance(analyses, options.noise, combs))
        return StudyResult(content={"by_chance": rows}, text=text_rows(rows))
    tried = list[Row]()
    for number, (rig, analysis) in enumerate(analyses):
        progress("combs at meaningless orders", number / len(analyses))
        tried += tried_combs(rig, analysis, DESIGNS, combs)
    progress("combs at meaningless orders", 1.0)
    content = placebos(tried)
    with ProcessPoolExecutor(options.jobs) as pool:
        of_kind = partial(placebo_lines, count=min(records, PLACEBO_RECORDS))
        rows = list(itertools.chain.from_iterable(pool.map(of_kind, BACKGROUNDS)))
        content["placebo_lines"] = [*rows, *of_all_kinds(rows)]
        progress("placebo lines", 1.0)
        content["naming"] = list(pool.map(partial(alarms, count=records), BACKGROUNDS))
    text = "\n\n".join(f"{name.replace('_', ' ')}\n{text_rows(rows)}" for name, rows in content.items())
    return StudyResult(name="false_alarms", content=content, text=text, inputs=input_hashes(*dict.fromkeys(files)))
