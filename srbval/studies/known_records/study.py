"""What faults are named from: features of records of known state.

Every registered measured record of known state is read once as what it is; each faulty one also with a shaft speed
wrong by 13 % and by -10 % and with another bearing, which must come out as something else. Written as a table,
``srbval/diagnosis/known_records.csv``.
"""

import contextlib
import csv
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from pathlib import Path

from srbval.bearing import DEFECTS
from srbval.diagnosis.fault_scores import fault_scores
from srbval.errors import SrbvalError
from srbval.progress import Progress
from srbval.reading.analyse import analyse
from srbval.recordings.registry import listing
from srbval.studies.harness import Study, StudyResult
from srbval.studies.known_state import (
    KnownRecord,
    known_records,
    readings,
    specimen,
)

COLUMNS = ("rig", "specimen", "state", *(fault.value for fault in DEFECTS), "unexplained")
HEAD = "# Features of records of known state; written by srbval study run known_records\n"


def rows(record: KnownRecord) -> Iterator[dict[str, object]]:
    """One row of the record as it is, and of a faulty one those of what it is not."""
    recording, bearing = record.load()
    for state, analysis in readings(record, analyse(recording, bearing=bearing)):
        values = (f"{value:.2f}" for value in fault_scores(analysis).features)
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
