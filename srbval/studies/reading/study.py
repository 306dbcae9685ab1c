"""Accuracy with which frequencies of lines are read, and false findings on records without a fault.

On combs (a line with harmonics) in noise: frequency error relative to the Cramer-Rao bound, and coverage of the stated
95 % interval. On records without a fault: number of faults named, and a test that false-alarm probabilities of lines at
meaningless orders (placebos) are uniformly distributed, as chance requires.
"""

import dataclasses
import itertools
import math
from argparse import Namespace
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from srbval.bearing import Fault, FaultOrders
from srbval.diagnosis.fault_verdict import fault_verdict
from srbval.processes.machine import one_thread
from srbval.processes.worker import in_processes
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.families import families_of, is_placebo_order, window_share
from srbval.reading.lines import Line, detected_fault_lines, read_lines
from srbval.reading.pipeline import periodogram_of
from srbval.recordings import Origin, Recording, ShaftSpeed, SpeedSource, load_recording
from srbval.signal import NORMAL_95, read_comb
from srbval.storage.installation import shipped_folder
from srbval.studies.harness import StudyResult
from srbval.studies.reading import records
from srbval.sweep.sweep import grid

Row = dict[str, Any]
Task = tuple[Any, ...]
CELLS = grid(seconds=(1.0, 3.4, 10.0, 30.0), snr_db=(16.0, 25.0, 35.0), jitter=(0.0, 0.003, 0.01, 0.03))
COMBS, RECORDS = 120, 50  # of each cell, and of each kind of background
HEALTHY = ("H_353rpm_sample", "H_877rpm_sample")  # records of the rig that ship
PLACEBOS, HEALTHY_PLACEBOS = 8, 40  # bearings for each record of a background, and for a healthy record
FACTORS, BAND_HZ = (0.7, 1.4), (500.0, 5500.0)  # factors on the bearing's orders; band of the backgrounds
OFF_SHARE, HALF_SHARE = 0.001, 0.01  # distance of the window's middle from the line, and half its width
LEVEL, CHANCES = 0.01, {"noise": "noise_false_alarm", "rank": "placebo_false_alarm", "stated": "false_alarm"}


def accuracy(seconds: float, snr_db: float, jitter: float, combs: int = COMBS) -> Row:
    """Accuracy of the line frequency read in `combs` random records of one length, noise level and jitter.

    All values but `detected` refer to detected lines, since only these have a stated frequency. The Cramer-Rao bound
    includes noise alone. `ci95_over_error`: median 95 % half width over 1.96 times the root-mean-square error.
    """
    rng = np.random.default_rng((round(seconds), round(snr_db), round(1e3 * jitter)))
    window_hz = (records.LINE_HZ * (1 + OFF_SHARE), records.LINE_HZ * HALF_SHARE)
    made = (records.comb(rng, seconds, snr_db, jitter) for _ in range(combs))
    found = [read_comb(one, *window_hz, period_s=1 / records.SHAFT_HZ) for one in made]
    detected = [one for one in found if one is not None and one.detected]
    error, half = np.array([(one.found_hz - records.LINE_HZ, one.ci95_hz) for one in detected]).reshape(-1, 2).T
    rmse = math.sqrt(np.mean(error**2)) if detected else math.nan
    return {
        "turns": seconds * records.SHAFT_HZ,
        "snr_db": snr_db,
        "jitter": jitter,
        "combs": combs,
        "detected": len(detected),
        "rmse_over_bound": rmse / records.bound_hz(seconds, snr_db),
        "covered": int(np.sum(np.abs(error) <= half)),
        "ci95_over_error": float(np.median(half)) / (NORMAL_95 * rmse) if detected else math.nan,
    }


def placebos(analysis: Analysis, count: int, seed: int) -> Iterator[Line]:
    """Yield lines at the orders of `count` fictitious bearings, which have no meaning in the record."""
    bearing, speed = analysis.bearing, analysis.speed
    record, families = periodogram_of(analysis.processed, bearing, speed), families_of(bearing, speed.value_hz)
    for factor in np.random.default_rng(seed).uniform(*FACTORS, count):
        orders = FaultOrders(**{name: factor * order for name, order in vars(bearing.orders).items()})
        lines = read_lines(record, dataclasses.replace(bearing, orders=orders), speed)
        faults = [one for one in lines if one.is_first and Fault.of_line(one.name) and one.false_alarm is not None]
        hz = np.array([one.kinematic_hz for one in faults])
        usable = is_placebo_order(hz, window_share(bearing, speed), families, speed)
        yield from itertools.compress(faults, usable)


def without_fault(name: str, analyses: Sequence[Analysis], count: int) -> Row:
    """Count faults named on records without a fault; test false alarms at the orders of `count` fictitious bearings.

    A line has three false-alarm probabilities: from the noise, from its rank among placebos (lines at meaningless
    orders), and the stated one, which combines both. ``noise_below``, ``rank_below`` and ``stated_below`` are the
    shares of lines with a probability below `LEVEL`. `distance` is the Kolmogorov-Smirnov distance of the
    probabilities by rank from a uniform distribution.
    """
    from scipy.stats import kstest

    lines = [line for number, one in enumerate(analyses) for line in placebos(one, count, number)]
    chances = {key: np.array([getattr(line, field) for line in lines]) for key, field in CHANCES.items()}
    return {
        "background": name,
        "records": len(analyses),
        "named": sum(fault_verdict(one).part is not None for one in analyses),
        "line_detected": sum(bool(detected_fault_lines(one.lines)) for one in analyses),
        "placebos": len(lines),
        "distance": float(kstest(chances["rank"], "uniform").statistic),
        **{f"{key}_below": float(np.mean(values < LEVEL)) for key, values in chances.items()},
    }


def background(name: str, count: int = RECORDS) -> Row:
    """False findings on `count` synthetic records of the background `name`, read as records of a ball bearing."""
    speed = ShaftSpeed(value_hz=records.MACHINE_HZ, ci95_hz=5e-4 * records.MACHINE_HZ, source=SpeedSource.STATED)
    stated: dict[str, Any] = {"fs_hz": records.RATE_HZ, "unit": "m/s2", "channel": "x", "speed": speed}
    read = []
    for number in range(count):
        samples = records.BACKGROUNDS[name](np.random.default_rng((3, number)))
        recording = Recording(name=name, origin=Origin.MEASURED, channels={"x": samples}, **stated)
        read.append(analyse(recording, bearing="skf-6205", band_hz=BAND_HZ))
    return without_fault(name, read, PLACEBOS)


def healthy(name: str) -> Row:
    """False findings on the healthy rig record `name`."""
    recording = load_recording(shipped_folder("data_manifest/rig_excerpts") / f"{name}.h5")
    return without_fault(name, [analyse(recording, bearing="skf-22240")], HEALTHY_PLACEBOS)


@one_thread()
def row_of(task: Task) -> Any:
    """Call a function with its arguments, as one task of the process pool."""
    return task[0](*task[1:])


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Compute the accuracy of frequencies read from synthetic combs, and false findings on records without a fault."""
    tasks: list[Task] = [(background, name) for name in records.BACKGROUNDS]
    tasks += [(healthy, name) for name in HEALTHY]
    cells: list[Task] = [(accuracy, *map(float, cell)) for cell in CELLS.to_numpy()]
    found: dict[Task, Row] = {}
    for task, row in in_processes(row_of, [*tasks, *cells], jobs=options.jobs):
        found[task] = row
        progress("read records", len(found) / (len(tasks) + len(cells)))
    content = {"without_fault": [found[task] for task in tasks], "accuracy": [found[task] for task in cells]}
    return StudyResult(name="reading", content=content, text="\n\n".join(map(text_rows, content.values())))
