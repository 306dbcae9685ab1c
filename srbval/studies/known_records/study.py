"""What faults are named from: features of records of known state.

Every registered measured record of known state is read once as what it is; each faulty one also with a shaft speed
wrong by 13 % and by -10 % and with another bearing, which must come out as something else. Written as a table,
``srbval/diagnosis/known_records.csv``.
"""

import contextlib
import csv
import dataclasses
import re
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from pathlib import Path

from srbval.bearing import DEFECTS, load_bearing
from srbval.diagnosis.fault_evidence import fault_evidence
from srbval.diagnosis.fault_posterior import OTHER
from srbval.errors import SrbvalError
from srbval.progress import Progress
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings.registry import listing
from srbval.studies.diagnosis.study import KnownRecord, known_records
from srbval.studies.harness import Study, StudyResult

WRONG_SPEEDS = (1.13, 0.9)
# Of this bearing; the first one's of any other. No fault order of the wrong one is a race's of the right one.
WRONG_BEARING = {"mfpt-nice": "skf-6203"}
# Which bearing of its rig a record is of, by its file's name; IMS has two channels per bearing.
SPECIMENS = {
    "cwru": r"_((?:IR|OR|B)\d+|Normal).*_\d\d?k?(DE|FE)|_((?:IR|OR|B)\d+|Normal)",
    "hit-sm": r"^(Normal|IR\d|OR\d)",
    "mfpt": r"^(Inner|Outer|baseline)",
    "uestc": r"^([NBIO])_",
    "torino": r"^(H|IR|OR|Roller)_",
}
COLUMNS = ("rig", "specimen", "state", *(fault.value for fault in DEFECTS), "unexplained")
HEAD = "# Features of records of known state; written by srbval study run known_records\n"


def specimen(record: KnownRecord) -> str:
    """The bearing within its rig."""
    if record.entry.dataset == "ims":
        return f"bearing {(int((record.entry.channel or 'ch1')[2:]) + 1) // 2}"
    pattern = next((p for name, p in SPECIMENS.items() if (record.entry.dataset or "").startswith(name)), "(.*)")
    found = re.search(pattern, Path(record.entry.file).stem)
    return "-".join(filter(None, found.groups())) if found else Path(record.entry.file).stem


def readings(record: KnownRecord, read: Analysis) -> Iterator[tuple[str, Analysis]]:
    """The record as `read`, of its state, and a faulty one also as what it is not, as something else."""
    yield record.state.value, read
    if record.state in DEFECTS:
        for factor in WRONG_SPEEDS:
            wrong = {"value_hz": factor * read.speed.value_hz, "ci95_hz": factor * read.speed.ci95_hz}
            yield OTHER, dataclasses.replace(read, speed=dataclasses.replace(read.speed, **wrong))
        other = load_bearing(WRONG_BEARING.get(read.bearing.name, next(iter(WRONG_BEARING))))
        yield OTHER, dataclasses.replace(read, bearing=other)


def rows(record: KnownRecord) -> Iterator[dict[str, object]]:
    """One row of the record as it is, and of a faulty one those of what it is not."""
    recording, bearing = record.load()
    for state, analysis in readings(record, analyse(recording, bearing=bearing)):
        values = (f"{value:.2f}" for value in fault_evidence(analysis).features)
        yield dict(zip(COLUMNS, (record.rig, specimen(record), state, *values), strict=True))


def _options(parser: ArgumentParser) -> None:
    parser.add_argument("--table", metavar="FILE", required=True, help="CSV: srbval/diagnosis/known_records.csv")


def _run(options: Namespace, progress: Progress) -> StudyResult:
    found, records = [], known_records(listing().recordings)
    for number, record in enumerate(records):
        progress("read the records", number / len(records))
        with contextlib.suppress(SrbvalError):
            found += list(rows(record))
    progress("read the records", 1.0)
    with Path(options.table).open("w", newline="", encoding="utf-8") as file:
        file.write(HEAD)
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
    return StudyResult(content={"rows": found}, text=f"{len(found)} rows written to {options.table}")


STUDY = Study(
    question="What do the features of faults look like in records of known state?", minutes=3, run=_run,
    options=_options,
)  # fmt: skip
