"""Placebo probabilities on real records.

Combs at meaningless orders of healthy records are ranked as a family would be: their ranks must be uniform. Whatever
was chosen in the design, that is from how many fundamentals a placebo's lines come, is chosen again for each rig on the
others alone.

The combs of one rig are not independent: a record holds some tens whose windows do not overlap. So beside a rig's
distance from uniform stands what the same number of combs give by chance: ``--noise N`` prints it, from N white noises
in the place of each record.
"""

import dataclasses
import math
import os
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from srbval.arrays import FloatArray
from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.errors import DataError
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.families import Family, families_of, half_window_hz, placebo_fundamentals
from srbval.reading.pipeline import periodogram_of
from srbval.recordings import Recording, load_recording
from srbval.signal import Periodogram, read_comb
from srbval.signal.false_alarm import APART, GRID, ORDERS, rank_among_placebos
from srbval.studies.harness import Study, StudyResult

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
COMBS_PER_FAMILY, SEED = 40, 1
LEVELS = (0.005, 0.01, 0.02, 0.05)


# Fundamentals that a placebo's lines come from, the design's own first. One: a whole comb; five: each line by itself.
DESIGNS = (ORDERS, 1, 3, 5)


@dataclass(frozen=True, kw_only=True)
class RankedComb:
    """A comb at a meaningless order: `placebo` [designs] and `noise`-only probability; is it detected by the latter?"""

    rig: str
    placebo: tuple[float, ...]
    noise: float
    detected_before: bool
    share: float  # of an independent comb: windows that do not overlap, over combs drawn


def tried_combs(rig: str, analysis: Analysis, designs: Sequence[int], count: int) -> Iterator[RankedComb]:
    """`count` combs about each race and roller family of a healthy record, each read as a family would be."""
    bearing, speed = analysis.bearing, analysis.speed
    record = periodogram_of(analysis.processed, bearing, speed)
    families = families_of(bearing, speed.value_hz)
    rng = np.random.default_rng(SEED)
    for family in families[: len(DEFECTS)]:
        half_hz = half_window_hz(family.kinematic_hz, record, bearing.largest_slip)
        about = read_comb(record, family.kinematic_hz, half_hz, shortest_block_s=None)
        if about is None:
            continue
        relative = half_hz / family.kinematic_hz
        pool = placebo_fundamentals(family, about, record, families, speed)
        for centre in rng.choice(pool, count) if pool.size else ():
            alike = dataclasses.replace(family, kinematic_hz=float(centre))
            placebo = tuple(_rank(record, alike, relative, len(about.snr), pool, orders) for orders in designs)
            reading = read_comb(
                record, alike.kinematic_hz, relative * centre, harmonics=len(about.snr), shortest_block_s=None
            )
            if reading is None or math.isnan(placebo[0]):
                continue
            yield RankedComb(
                rig=rig, placebo=placebo, noise=reading.noise_false_alarm, detected_before=reading.detected,
                share=min(1.0, pool.size / (2 * GRID * count)),
            )  # fmt: skip


def as_noise(analysis: Analysis, seed: int) -> Analysis:
    """The same with white noise in the place of its squared envelope: whatever is not uniform there is chance."""
    squared = 3 + np.random.default_rng(seed).standard_normal(analysis.processed.squared.size)
    return dataclasses.replace(analysis, processed=dataclasses.replace(analysis.processed, squared=squared))


def by_chance(analyses: Sequence[tuple[str, Analysis]], repeats: int, count: int) -> Iterator[dict[str, object]]:
    """Per rig the distance from uniform that noise gives, in `repeats` trials of `count` combs per family."""
    for rig in dict.fromkeys(rig for rig, _ in analyses):
        own = [analysis for name, analysis in analyses if name == rig]
        distances = [
            distance([t.placebo[0] for a in own for t in tried_combs(rig, as_noise(a, seed), (ORDERS,), count)])
            for seed in range(repeats)
        ]
        yield {"rig": rig, "median": float(np.median(distances)), "highest": max(distances), "trials": repeats}


def _rank(record: Periodogram, family: Family, relative: float, harmonics: int, pool: FloatArray, orders: int) -> float:
    """As a family there would be ranked: its own surroundings are not meaningless."""
    centre = family.kinematic_hz
    apart = pool[np.abs(pool / centre - 1) >= APART * relative]
    found = rank_among_placebos(record, centre, relative * centre, harmonics, apart, orders=orders)
    return math.nan if found is None else found.false_alarm


def distance(chances: Sequence[float]) -> float:
    """Kolmogorov-Smirnov distance of `chances` from the uniform distribution."""
    ordered = np.sort(np.asarray(chances))
    steps = np.arange(ordered.size + 1) / ordered.size
    return float(max(np.max(steps[1:] - ordered), np.max(ordered - steps[:-1])))


def _row(name: str, chances: Sequence[float]) -> dict[str, Any]:
    values = [c for c in chances if not math.isnan(c)]
    rates = {f"below {level}": float(np.mean(np.array(values) < level)) for level in (0.001, 0.01, 0.05)}
    return {"of": name, "combs": len(values), "distance": distance(values)} | rates


def left_out(tried: Sequence[RankedComb]) -> list[tuple[str, int, list[float]]]:
    """Per rig the design whose rate below 0.01 is nearest to that on all other rigs, and the ranks it gives here."""
    chosen = []
    for rig in dict.fromkeys(t.rig for t in tried):
        others = np.array([t.placebo for t in tried if t.rig != rig])
        rates = np.maximum(np.nanmean(np.where(np.isnan(others), np.nan, others < 0.01), axis=0), 1e-4)
        best = int(np.argmin(np.abs(np.log(rates / 0.01))))
        chosen.append((rig, best, [t.placebo[best] for t in tried if t.rig == rig]))
    return chosen


def healthy(folder: Path) -> Iterator[tuple[str, Recording, Bearing]]:
    """Rig, record and bearing of those of `HEALTHY` that are there."""
    for rig, name, channel, bearing in HEALTHY:
        if (folder / name).is_file():
            recording = load_recording(folder / name, channel=channel)
            yield rig, dataclasses.replace(recording, state=Fault.HEALTHY), load_bearing(bearing)


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--combs", metavar="N", type="count", default=COMBS_PER_FAMILY, help="per family and record")
    parser.add_argument("--noise", metavar="N", type="count", help="only what N noises per record give by chance")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    folder = os.environ.get("SRBVAL_RECORDINGS")
    if not folder:
        raise DataError("SRBVAL_RECORDINGS names no folder of recordings; this study reads those of known data sets.")
    analyses = [(rig, analyse(recording, bearing=bearing)) for rig, recording, bearing in healthy(Path(folder))]
    if options.noise:
        rows = list(by_chance(analyses, options.noise, options.combs))
        return StudyResult(content={"by_chance": rows}, text=text_rows(rows))
    tried = list[RankedComb]()
    for number, (rig, analysis) in enumerate(analyses):
        progress("combs at meaningless orders", number / len(analyses))
        tried += tried_combs(rig, analysis, DESIGNS, options.combs)
    progress("combs at meaningless orders", 1.0)
    designs = [_row(f"{design} fundamentals", [t.placebo[n] for t in tried]) for n, design in enumerate(DESIGNS)]
    by_rig = [
        _row(rig, [t.placebo[0] for t in tried if t.rig == rig])
        | {"independent": round(independent := sum(t.share for t in tried if t.rig == rig))}
        | {"distance by chance": 1.36 / math.sqrt(independent)}
        for rig in dict.fromkeys(t.rig for t in tried)
    ]
    folds = left_out(tried)
    left = [_row(f"{rig}: {DESIGNS[n]} fundamentals", p) for rig, n, p in folds]
    by_noise, ranks = np.array([t.detected_before for t in tried]), np.array([t.placebo[0] for t in tried])
    shares = {f"ranks below {level}": float(np.mean(by_noise & (ranks < level))) for level in LEVELS}
    content: dict[str, list[dict[str, Any]]] = {
        "combs": [_row("noise only", [t.noise for t in tried]), *designs],
        "by_rig": by_rig,  # "distance by chance": what one time in twenty exceeds
        "design_chosen_on_the_others": [*left, _row("all", [x for *_, p in folds for x in p])],
        "detected": [{"noise only": float(np.mean(by_noise))} | shares],
    }
    text = "\n\n".join(f"{name.replace('_', ' ')}\n{text_rows(rows)}" for name, rows in content.items())
    return StudyResult(name="placebo", content=content, text=text)


STUDY = Study(question="Are placebo probabilities uniform on healthy records?", minutes=3, run=_run, options=_options)
