"""How often faults are diagnosed correctly on machines nobody tuned to: records of known state, by several methods.

No method sees the state that a record's name or data set declares. "joint test": the most probable class, called where
it is probable enough, by the record alone against records of known state of other rigs (`diagnose`). "lines": the fault
lines that `analyse` detects, the deepest named first, called against the healthy record of the same point; in the data
set's band, or in one chosen on the record. The plain ones are how it is commonly done: the highest of the fault lines
in an envelope spectrum, above a threshold; they call whatever they name, and nothing in them was fitted to a record.
"""

import itertools
import time
from argparse import ArgumentParser, Namespace
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from scipy.stats import binomtest

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.diagnosis.baseline import compare_with_baseline
from srbval.diagnosis.diagnose import diagnose
from srbval.errors import DataError, SrbvalError
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.lines import detected_fault_lines
from srbval.reading.pipeline import band_kurtogram, declared_band, one_signal
from srbval.recordings import Recording, ShaftSpeed
from srbval.recordings.registry import RegisteredRecording, healthy_baseline, listing, load_entry
from srbval.signal import amplitude_spectrum, drop_ends, end_s, normalise, squared_envelope_one_pass
from srbval.storage.json_files import to_json
from srbval.studies.diagnosis.known_records import KnownRecord, known_records, write_table
from srbval.studies.diagnosis.reliability import naming_scores
from srbval.studies.harness import Study, StudyResult, input_hashes, printed_columns

ALL = "all"
ANSWERS = {"first named": "named", "called": "called"}
NOTHING = "nothing"
# A line counts from this many times the median amplitude of its neighbourhood.
THRESHOLD = 5.0
# Half widths of a line's window and of its neighbourhood, as shares of its frequency.
WINDOW, NEIGHBOURHOOD = 0.02, 0.2
Row = dict[str, Any]


class Prediction(NamedTuple):
    """What a method says of a record: the fault it names first, and the one it calls; None: neither."""

    named: Fault | None
    called: Fault | None


Method = Callable[[str, Recording, Bearing], Prediction]  # of the rig's name, the record and its bearing


def methods(registered: Sequence[RegisteredRecording]) -> dict[str, Method]:
    """The ways of naming, by name; `registered` holds the healthy records that a call is made against."""
    baselines: dict[tuple[str, str, tuple[float, float] | None], Analysis] = {}  # by file, bearing and band

    def healthy(recording: Recording, bearing: Bearing, band_hz: tuple[float, float] | None) -> Analysis | None:
        entry = healthy_baseline(recording, tuple(registered))
        if entry is None:
            return None
        key = entry.file, bearing.name, band_hz
        if key not in baselines:
            baselines[key] = analyse(load_entry(entry), bearing=bearing, band_hz=band_hz)
        return baselines[key]

    def by_lines(recording: Recording, bearing: Bearing, *, choose: bool) -> Prediction:
        analysis = analyse(recording, bearing=bearing, choose_on_record=choose)
        deepest = next((Fault.of_line(line.name) for line in detected_fault_lines(analysis.lines)), None)
        band_hz = analysis.processed.band_hz if choose else None
        call = compare_with_baseline(analysis, healthy(recording, bearing, band_hz))
        return Prediction(deepest, call.risen)

    def jointly(rig: str, recording: Recording, bearing: Bearing) -> Prediction:
        naming = diagnose(analyse(recording, bearing=bearing), all_channels=True, without_rig=rig)
        return Prediction(naming.most_probable, Fault(naming.state) if naming.state in DEFECTS else None)

    def plain(recording: Recording, bearing: Bearing, *, impulsive: bool) -> Prediction:
        assert recording.speed is not None, "every set states one"
        kurtogram = band_kurtogram(recording, bearing, recording.speed) if impulsive else None
        band_hz = declared_band(recording, None).band_hz if kurtogram is None else kurtogram.best_hz
        found = strongest_line(recording, bearing, recording.speed, band_hz)
        return Prediction(found, found)

    return {
        "joint test": jointly,
        "lines": lambda _, r, b: by_lines(r, b, choose=False),
        "lines, band chosen": lambda _, r, b: by_lines(r, b, choose=True),
        "plain, fixed band": lambda _, r, b: plain(r, b, impulsive=False),
        "plain, kurtogram": lambda _, r, b: plain(r, b, impulsive=True),
    }


def strongest_line(
    recording: Recording, bearing: Bearing, speed: ShaftSpeed, band_hz: tuple[float, float]
) -> Fault | None:
    """The fault whose line stands highest over its neighbourhood's median; None where none reaches `THRESHOLD`.

    Amplitudes of the squared envelope in `band_hz` [Hz]; first harmonics, within `WINDOW` of kinematics at `speed`.
    """
    square, rate = squared_envelope_one_pass(normalise(one_signal(recording)), recording.fs_hz, band_hz)
    spectrum = amplitude_spectrum(drop_ends(square, rate, end_s(band_hz)), rate)
    ratios = {}
    for fault in DEFECTS:
        kinematic_hz = fault.line_order(bearing.orders) * speed.value_hz
        off = np.abs(spectrum.frequency_hz / kinematic_hz - 1)
        inside, about = off <= WINDOW, (off > WINDOW) & (off <= NEIGHBOURHOOD)
        if inside.any() and about.any():
            ratios[fault] = float(spectrum.amplitude[inside].max() / np.median(spectrum.amplitude[about]))
    best = max(ratios, key=lambda fault: ratios[fault], default=None)
    return best if best is not None and ratios[best] >= THRESHOLD else None


def score(records: Sequence[KnownRecord], ways: Mapping[str, Method], *, progress: Progress = silent) -> list[Row]:
    """Every record by every method, with the processor time that it took [s].

    A record that a method refuses is one it says nothing of; `refused` says why.
    """
    found = []
    for number, record in enumerate(records):
        progress("Score the registered recordings", number / len(records))
        for name, way in ways.items():
            recording, bearing = record.load()
            start, refused = time.thread_time(), ""
            try:
                said = way(record.rig, recording, bearing)
            except SrbvalError as error:
                said, refused = Prediction(None, None), str(error)
            found.append(said._asdict() | {
                "method": name, "dataset": record.entry.dataset or "", "rig": record.rig,
                "file": "/".join(Path(record.entry.file).parts[-2:]), "channel": recording.channel,
                "state": record.state, "seconds": time.thread_time() - start, "refused": refused,
            })  # fmt: skip
    progress("Score the registered recordings", 1.0)
    return found


def confusions(scored: Sequence[Row]) -> Iterator[Row]:
    """Per method and answer, what was first named or what was called: all data sets together, then each.

    `counts` by state and by what was said, "nothing" where no fault was. Of records with a fault `right`, `wrong` (for
    which another was named) and `silent`; of healthy ones `alarms`. Intervals are Wilson's, of records: those of one
    rig are alike, so that they are narrower than for as many rigs.
    """
    names = (ALL, *dict.fromkeys(one["dataset"] for one in scored))
    for method, (answer, key), name in itertools.product(
        dict.fromkeys(one["method"] for one in scored), ANSWERS.items(), names
    ):
        own = [one for one in scored if one["method"] == method and name in (ALL, one["dataset"])]
        pairs = Counter((one["state"].value, (one[key] or NOTHING)) for one in own)
        said = (NOTHING, *(fault.value for fault in DEFECTS))
        counts = {state.value: {one: pairs[state.value, one] for one in said} for state in Fault}
        faulty, healthy = sum(sum(counts[fault].values()) for fault in DEFECTS), sum(counts[Fault.HEALTHY].values())
        right, silent_ = sum(counts[f][f] for f in DEFECTS), sum(counts[f][NOTHING] for f in DEFECTS)
        wrong, alarms = faulty - right - silent_, healthy - counts[Fault.HEALTHY][NOTHING]
        yield {
            "method": method, "answer": answer, "dataset": name, "rigs": len({one["rig"] for one in own}),
            "counts": counts, "faulty": faulty, "right": right, "wrong": wrong, "silent": silent_, "healthy": healthy,
            "alarms": alarms, "right_ci95": _wilson(right, faulty), "wrong_ci95": _wilson(wrong, faulty),
            "alarms_ci95": _wilson(alarms, healthy),
        }  # fmt: skip


def _wilson(count: int, of: int) -> tuple[float, float] | None:
    """95 % interval of a share, `count` of `of` (Wilson 1927, J. Am. Stat. Assoc. 22, 209); None of nothing."""
    return tuple(binomtest(count, of).proportion_ci(method="wilson")) if of else None


def _text(content: Row) -> str:
    parts, rows = [], []
    for row in content["confusions"]:
        if row["dataset"] == ALL:
            counts = [{"state": state, **said} for state, said in row["counts"].items()]
            parts.append(f"{row['method']}, {row['answer']}:\n{printed_columns(__package__, 'counts', counts)}")
        if row["healthy"] + row["faulty"]:
            shares = {name: row[f"{name}_ci95"] for name in ("right", "wrong", "alarms")}
            words = {f"{n}_range": f"{100 * v[0]:.0f} to {100 * v[1]:.0f}" if v else "" for n, v in shares.items()}
            rows.append(row | words)
    for scores in (content["naming"]["scores"], content["naming"]["wrongly_read"]):
        parts.append(", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in scores.items()))
    return "\n\n".join([*parts, printed_columns(__package__, "methods", rows)])


def _options(parser: ArgumentParser) -> None:
    parser.add_argument(
        "--table", metavar="FILE", help="only write what faults are named from: srbval/diagnosis/known_records.csv"
    )


def _run(options: Namespace, progress: Progress) -> StudyResult:
    """`DataError` where no record of known state is registered."""
    registered = listing().recordings
    records = known_records(registered)
    if not records:
        raise DataError(
            "no measured recording of known state is registered; register some with srbval data add DIR, or name their "
            "folder in SRBVAL_RECORDINGS."
        )
    if options.table:
        rows = write_table(Path(options.table), records, progress)
        return StudyResult(content={"rows": rows}, text=f"{len(rows)} rows written to {options.table}")
    scored = score(records, methods(registered), progress=progress)
    content: Row = to_json({"confusions": list(confusions(scored)), "naming": naming_scores(), "records": scored})
    inputs = input_hashes(*(record.entry for record in records))
    return StudyResult(name="diagnosis", content=content, text=_text(content), inputs=inputs)


STUDY = Study(
    question="How often are faults in the registered recordings diagnosed correctly, against two simple methods?",
    minutes=2, run=_run, options=_options,
)  # fmt: skip
