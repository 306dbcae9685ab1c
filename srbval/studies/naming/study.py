"""Share of faults named correctly in recordings with a known state, by several methods.

No method uses the state in the record's name or data set. The method "record alone" diagnoses one record, "one
machine" all records of a bearing together. "another speed or bearing" diagnoses faulty records with a wrong shaft speed
or as records of a wrong bearing; there, any named part counts as wrong. With ``--graded`` the benchmark of Smith &
Randall is diagnosed too, and compared with the answers of a public tool (``graded.csv``).
"""

import csv
from argparse import Namespace
from collections import Counter, defaultdict
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from srbval.bearing import DEFECTS, Fault
from srbval.diagnosis.fault_posterior import CLASSES, decide, faults_of, of_one_machine, probabilities
from srbval.diagnosis.fault_verdict import fault_verdict
from srbval.diagnosis.records import RecordRequest, read_record
from srbval.errors import DataError
from srbval.processes.worker import in_processes
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings.registry import listing
from srbval.storage.files import file_sha256
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import read_json
from srbval.studies.harness import StudyResult
from srbval.studies.naming.records import KnownRecord, known_records, otherwise

Row = dict[str, Any]
GRADED = Path(__file__).with_name("graded.csv")
# Part that the public tool names, by the line that it ranks first.
PUBLIC = {"BPFO": Fault.OUTER, "BPFI": Fault.INNER, "BSF": Fault.ROLLER, "FTF": "cage", "none": None}
KEYS = ("right", "wrong", "none", "healthy_called")
ALONE, MACHINE, OTHERWISE = "record alone", "one machine", "another speed or bearing"
FIRST_RUN, LATER_RUN = "graded", "graded_later"  # of the graded benchmark


def see(record: KnownRecord) -> Row:
    """Diagnose a record; a faulty one also with wrong speeds and a wrong bearing, where any named part is an error."""
    recording, bearing = record.load()
    analysis = analyse(recording, bearing=bearing)
    verdict = fault_verdict(analysis, all_channels=True)
    assert verdict.diagnosis is not None, "every known record is measured"
    others = otherwise(recording, bearing) if record.state in DEFECTS else ()
    return {
        "rig": record.rig,
        "specimen": record.specimen,
        "dataset": record.entry.dataset,
        "file": "/".join(Path(record.entry.file).parts[-2:]),
        "channel": record.entry.channel,
        "state": record.state,
        "called": {ALONE: verdict.part},
        "probability": max(verdict.diagnosis.probabilities.values()),
        "log_likelihood": verdict.diagnosis.log_likelihood,
        "called_otherwise": [fault_verdict(analyse(one, bearing=as_of)).part for one, as_of in others],
    }


def call_machines(rows: Sequence[Row]) -> None:
    """Add to each record's row the faulty part that is named from all records of its bearing."""
    bearings = [(one["rig"], one["specimen"], one["state"]) for one in rows]
    for row, bearing in zip(rows, bearings, strict=True):
        own = [one["log_likelihood"] for one, of in zip(rows, bearings, strict=True) if of == bearing]
        row["called"][MACHINE] = next(iter(faults_of(decide(probabilities(of_one_machine(own))))), None)


def counted(rows: Sequence[Row]) -> list[Row]:
    """Count right, wrong and missing fault names, and healthy records called faulty, by method, data set and state."""
    outcomes: dict[tuple[str, str, str], Counter[str]] = defaultdict(Counter)
    for row, (name, part) in ((one, call) for one in rows for call in one["called"].items()):
        for group in (("all", "all"), ("set", row["dataset"]), ("class", row["state"].label)):
            outcomes[name, *group][outcome_of(row["state"], part)] += 1
    for part in (part for row in rows for part in row.get("called_otherwise", ())):
        outcomes[OTHERWISE, "all", "all"]["none" if part is None else "wrong"] += 1
    return [
        dict(zip(("name", "by", "of"), group, strict=True))
        | {key: count[key] for key in KEYS}
        | {"faulty": sum(count[key] for key in KEYS[:3]), "healthy": count["healthy"] + count["healthy_called"]}
        for group, count in outcomes.items()
    ]


def outcome_of(state: Fault, part: str | None) -> str:
    """Outcome: right, wrong or none (no part named) if faulty; healthy, or healthy_called (a part named) if healthy."""
    if state not in DEFECTS:
        return "healthy" if part is None else "healthy_called"
    return "none" if part is None else "right" if part == state else "wrong"


def name_graded(row: Row) -> Row:
    """Diagnose a benchmark record; compare the verdicts of `analyse` and of a public tool with its true state."""
    state, verdict = Fault(row["state"]), read_record(RecordRequest(file=row["path"])).verdict
    assert verdict.diagnosis is not None, "the records are measured"
    shares = verdict.diagnosis.probabilities
    first = max(CLASSES[1:], key=lambda name: shares[name])
    return {
        "record": row["record"],
        "state": state,
        "grade": row["grade"],
        "verdict": verdict.finding,
        "called": verdict.part,
        "outcome": outcome_of(state, verdict.part),
        "ranked_first": first,
        "probability": shares[first],
        "public_outcome": outcome_of(state, PUBLIC[row["peer_first"]]),
    }


def graded(folders: Iterable[str], jobs: int | None, progress: Progress) -> Row:
    """Diagnose Smith & Randall's benchmark records in `folders`; count right diagnoses by difficulty and fault."""
    with GRADED.open(encoding="utf-8") as file:
        listed = list(csv.DictReader(line for line in file if not line.startswith("#")))
    stated = {row["sha256"]: row for row in listed}
    paths = sorted(path for folder in folders for path in Path(folder).rglob("*.mat"))
    found = {row["record"]: row | {"path": str(path)} for path in paths if (row := stated.get(file_sha256(path)))}
    if not found:
        raise DataError(f"{', '.join(folders)}: none of the {len(listed)} records of the benchmark is there.")
    rows = []
    for _, row in in_processes(name_graded, list(found.values()), jobs=jobs):
        rows.append(row)
        progress("name the graded records", len(rows) / len(found))
    rows.sort(key=lambda row: (row["grade"], row["state"], row["record"]))
    groups: dict[tuple[str, str], list[Row]] = defaultdict(list)
    for row in rows:
        groups[row["grade"], row["state"].label].append(row)
        groups[row["grade"], "all"].append(row)
    table = [
        {"grade": grade, "part": part, "records": len(own)}
        | {key: sum(row["outcome"] == key for row in own) for key in KEYS if key != "none"}
        | {"undecided": sum(row["called"] is None and row["verdict"] == "undecided" for row in own)}
        | {"nothing_found": sum(row["verdict"] == "nothing found" for row in own)}
        | {"first_right": sum(row["ranked_first"] == row["state"] for row in own)}
        | {f"public_{key}": sum(row["public_outcome"] == key for row in own) for key in KEYS if key != "none"}
        for (grade, part), own in sorted(groups.items())
    ]
    missing = sorted(row["record"] for row in listed if row["record"] not in found)
    return {"missing": missing, "table": table, "records": rows}


def with_graded(stored: Row, found: Row) -> Row:
    """Add a run of the graded benchmark to a `stored` result: the first run is kept, a later one replaces the last."""
    return {FIRST_RUN: stored.get(FIRST_RUN) or found, LATER_RUN: found if stored.get(FIRST_RUN) else None}


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Diagnose all registered records with a known state; raises `DataError` if there is none."""
    records = known_records(listing().recordings)
    if not records:
        raise DataError(
            "no measured recording of known state is registered; register some with srbval data add DIR, or name their "
            "folder in SRBVAL_RECORDINGS."
        )
    found: dict[KnownRecord, Row] = {}
    for record, row in in_processes(see, records, jobs=options.jobs):
        found[record] = row
        progress("read the records", len(found) / len(records))
    seen = [found[record] for record in records]
    call_machines(seen)
    sets = Counter(row["dataset"] for row in seen)
    content = {
        "data_sets": [{"name": name, "records": count} for name, count in sets.items()],
        "methods": counted(seen),
        "records": seen,
    }
    texts = [text_rows(content["methods"])]
    stored = read_json(shipped_folder("reports") / "naming.json")
    if options.graded:
        found_graded = graded(options.graded, options.jobs, progress)
        stored = with_graded(stored, found_graded)
        texts.append(text_rows(found_graded["table"]))
    content |= {name: stored.get(name) for name in (FIRST_RUN, LATER_RUN)}
    return StudyResult(name="naming", content=content, text="\n\n".join(texts))
