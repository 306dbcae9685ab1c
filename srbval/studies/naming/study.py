"""How often faults are named correctly in recordings of known state, by several methods.

No method sees the state that a record's name or data set declares. "record alone" is the posterior of `diagnose`, and
"one machine" that of all records of a bearing together, both with evidence learnt without the rig of the record.
The others learn nothing: the fault of the greatest excess, and the rules of common practice (`plain_rules`).
"""

from argparse import Namespace
from collections import Counter, defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from srbval.bearing import DEFECTS
from srbval.diagnosis.diagnose import contradicts_speed, fault_of, views_of
from srbval.diagnosis.fault_posterior import Evidence, decide, of_one_machine
from srbval.diagnosis.fault_scores import fault_scores
from srbval.diagnosis.learning import evidence_toml, fit_evidence
from srbval.diagnosis.plain_rules import by_excess, common_practice
from srbval.errors import DataError
from srbval.processes.pool import in_processes
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings.registry import listing
from srbval.studies.harness import StudyResult
from srbval.studies.naming.records import KnownRecord, known_records, readings

Row = dict[str, Any]


def see(record: KnownRecord) -> Row:
    """Features of all views of a record, what the methods without learning call, and its `readings`.

    `denied` are the parts whose lines contradict the speed.
    """
    recording, bearing = record.load()
    analysis = analyse(recording, bearing=bearing)
    scores = [one for _, one in views_of(analysis, all_channels=True)]
    own = {"rig": record.rig, "specimen": record.specimen}
    known = [(state, fault_scores(read).features) for state, read in readings(record.state, analysis)]
    return own | {
        "dataset": record.entry.dataset,
        "file": "/".join(Path(record.entry.file).parts[-2:]),
        "channel": record.entry.channel,
        "state": record.state,
        "called": {"excess 8, margin 3": by_excess([one.unmasked for one in scores])}
        | common_practice(recording, bearing),
        "views": [np.array(one.features) for one in scores],
        "denied": [fault for fault in DEFECTS if contradicts_speed(analysis, fault)],
        "known": [own | {"state": state, "features": [round(x, 2) for x in found]} for state, found in known],
    }


def named(seen: Sequence[Row], by_rig: Mapping[str, Evidence]) -> Iterator[Row]:
    """Highest probability of each record alone, and what is called of it and of all records of its bearing together."""
    alone = [by_rig[one["rig"]].log_likelihood(*one["views"]) for one in seen]
    bearings = [(one["rig"], one["specimen"], one["state"]) for one in seen]
    for one, own, bearing in zip(seen, alone, bearings, strict=True):
        every = [other for other, of in zip(alone, bearings, strict=True) if of == bearing]
        shares, together = (by_rig[one["rig"]].probabilities(found) for found in (own, of_one_machine(every)))
        part = fault_of(decide(shares))
        called = {"record alone": None if part in one["denied"] else part, "one machine": fault_of(decide(together))}
        yield {"probability": max(shares.values()), "called": called | one["called"]}


def counted(rows: Sequence[Row]) -> list[Row]:
    """Faulty records called right, wrong and not at all, and healthy ones called, by method: all, by set and class."""
    outcomes: dict[tuple[str, str, str], Counter[str]] = defaultdict(Counter)
    for row, (name, part) in ((one, call) for one in rows for call in one["called"].items()):
        outcome = "none" if part is None else "right" if part == row["state"] else "wrong"
        if row["state"] not in DEFECTS:
            outcome = "healthy" if part is None else "healthy_called"
        for group in (("all", "all"), ("set", row["dataset"]), ("class", row["state"].label)):
            outcomes[name, *group][outcome] += 1
    names, keys = ("name", "by", "of"), ("right", "wrong", "none", "healthy_called")
    return [
        dict(zip(names, group, strict=True))
        | {key: count[key] for key in keys}
        | {"faulty": sum(count[key] for key in keys[:3]), "healthy": count["healthy"] + count["healthy_called"]}
        for group, count in outcomes.items()
    ]


def run(options: Namespace, progress: Progress) -> StudyResult:
    """Raises `DataError` if no record of known state is registered."""
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
    known = pd.DataFrame([one for row in seen for one in row.pop("known")])
    by_rig = {rig: fit_evidence(known[known["rig"] != rig]) for rig in known["rig"].unique()}
    if options.evidence:
        Path(options.evidence).write_text(evidence_toml(fit_evidence(known)), encoding="utf-8")
    for row, more in zip(seen, list(named(seen, by_rig)), strict=True):
        row |= more
        del row["views"], row["denied"]
    sets = Counter(row["dataset"] for row in seen)
    content = {
        "data_sets": [{"name": name, "records": count} for name, count in sets.items()],
        "methods": counted(seen),
        "records": seen,
        "known": known.to_dict("records"),
    }
    return StudyResult(name="naming", content=content, text=text_rows(content["methods"]))
