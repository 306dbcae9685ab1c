"""How often faults are diagnosed correctly on machines nobody tuned to: records of known state, by several methods.

No method sees the state that a record's name or data set declares.
"""

import itertools
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from scipy.stats import binomtest

from srbval.bearing import DEFECTS, Bearing, Fault
from srbval.comparison.other_rigs import Baselines, healthy_analysis
from srbval.diagnosis.baseline import compare_with_baseline
from srbval.diagnosis.diagnose import diagnose
from srbval.errors import DataError, SrbvalError
from srbval.progress import Progress, silent
from srbval.reading.analyse import analyse
from srbval.reading.lines import detected_fault_lines
from srbval.reading.pipeline import band_kurtogram, declared_band
from srbval.recordings import Recording
from srbval.recordings.registry import RegisteredRecording, listing
from srbval.storage.json_files import to_json
from srbval.studies.diagnosis.simple_diagnosis import strongest_line
from srbval.studies.harness import Study, StudyResult, printed_columns
from srbval.studies.known_state import KnownRecord, known_records
from srbval.studies.naming_scores import naming_scores

ALL = "all"
NAMED, CALLED = "first named", "called"
NOTHING = "nothing"


@dataclass(frozen=True, kw_only=True)
class Named:
    """What a method says of a record: the fault it names first, and the one it calls; None: neither."""

    named: Fault | None
    called: Fault | None


Method = Callable[[str, Recording, Bearing], Named]  # of the rig's name, the record and its bearing


def methods(registered: Sequence[RegisteredRecording]) -> dict[str, Method]:
    """The ways of naming, by name; `registered` holds the healthy records that a call is made against.

    "joint test": the most probable class, called where it is probable enough, by the record alone against records of
    known state of other rigs (`diagnose`). "lines": the fault lines that `analyse` detects, the deepest named first,
    called against the healthy record of the same point; in the data set's band, or in one chosen on the record. The
    plain ones call whatever they name.
    """
    baselines = Baselines()

    def by_lines(recording: Recording, bearing: Bearing, *, choose: bool) -> Named:
        analysis = analyse(recording, bearing=bearing, choose_on_record=choose)
        deepest = next((Fault.of_line(line.name) for line in detected_fault_lines(analysis.lines)), None)
        band_hz = analysis.processed.band_hz if choose else None
        call = compare_with_baseline(analysis, healthy_analysis(recording, bearing, registered, baselines, band_hz))
        return Named(named=deepest, called=call.called)

    def jointly(rig: str, recording: Recording, bearing: Bearing) -> Named:
        naming = diagnose(analyse(recording, bearing=bearing), all_channels=True, without_rig=rig)
        state = naming.state if naming.state in DEFECTS else None
        return Named(named=naming.most_probable, called=None if state is None else Fault(state))

    def plain(recording: Recording, bearing: Bearing, *, impulsive: bool) -> Named:
        assert recording.speed is not None, "every set states one"
        kurtogram = band_kurtogram(recording, bearing, recording.speed) if impulsive else None
        band_hz = declared_band(recording, None).band_hz if kurtogram is None else kurtogram.best_hz
        found = strongest_line(recording, bearing, recording.speed, band_hz)
        return Named(named=found, called=found)

    return {
        "joint test": jointly,
        "lines": lambda _, r, b: by_lines(r, b, choose=False),
        "lines, band chosen": lambda _, r, b: by_lines(r, b, choose=True),
        "plain, fixed band": lambda _, r, b: plain(r, b, impulsive=False),
        "plain, kurtogram": lambda _, r, b: plain(r, b, impulsive=True),
    }


@dataclass(frozen=True, kw_only=True)
class Judged(Named):
    """One record by one method; `seconds` of processor time; `refused` says why it could not be judged."""

    method: str
    dataset: str
    rig: str
    file: str
    channel: str | None
    state: Fault
    seconds: float
    refused: str = ""


def judge(records: Sequence[KnownRecord], ways: Mapping[str, Method], *, progress: Progress = silent) -> list[Judged]:
    """Every record by every method; a record that a method refuses is one it says nothing of."""
    found = []
    for number, record in enumerate(records):
        progress("Judge the registered recordings", number / len(records))
        for name, way in ways.items():
            recording, bearing = record.load()
            start, refused = time.thread_time(), ""
            try:
                said = way(record.rig, recording, bearing)
            except SrbvalError as error:
                said, refused = Named(named=None, called=None), str(error)
            found.append(
                Judged(
                    **vars(said), method=name, dataset=record.entry.dataset or "", rig=record.rig,
                    file="/".join(Path(record.entry.file).parts[-2:]), channel=recording.channel, state=record.state,
                    seconds=time.thread_time() - start, refused=refused,
                )
            )  # fmt: skip
    progress("Judge the registered recordings", 1.0)
    return found


def _wilson(count: int, of: int) -> tuple[float, float] | None:
    """95 % interval of a share, `count` of `of` (Wilson 1927, J. Am. Stat. Assoc. 22, 209); None of nothing."""
    return tuple(binomtest(count, of).proportion_ci(method="wilson")) if of else None


@dataclass(frozen=True, kw_only=True)
class Confusion:
    """Judgements of one method, counted: `counts` by state and by what was said, "nothing" where no fault was.

    `answer` says whether what was first named counts, or what was called; `dataset` is "all" for all together. Records
    of one rig are alike, so that the intervals (Wilson's, of records) are narrower than for as many rigs.
    """

    JSON_PROPERTIES: ClassVar = (
        "faulty", "right", "wrong", "silent", "healthy", "alarms", "right_ci95", "wrong_ci95", "alarms_ci95",
    )  # fmt: skip

    method: str
    answer: str
    dataset: str
    rigs: int
    counts: Mapping[str, Mapping[str, int]]

    def _count(self, states: Iterable[Fault], said: Callable[[Fault, str], bool]) -> int:
        return sum(n for state in states for name, n in self.counts.get(state, {}).items() if said(state, name))

    @property
    def faulty(self) -> int:
        """Records with a fault."""
        return self._count(DEFECTS, lambda *_: True)

    @property
    def right(self) -> int:
        """Faults named correctly."""
        return self._count(DEFECTS, lambda state, said: said == state)

    @property
    def wrong(self) -> int:
        """Records with a fault for which another was named."""
        return self.faulty - self.right - self.silent

    @property
    def silent(self) -> int:
        """Records with a fault for which none was named."""
        return self._count(DEFECTS, lambda _, said: said == NOTHING)

    @property
    def healthy(self) -> int:
        """Healthy records."""
        return self._count((Fault.HEALTHY,), lambda *_: True)

    @property
    def alarms(self) -> int:
        """Healthy records for which a fault was named."""
        return self._count((Fault.HEALTHY,), lambda _, said: said != NOTHING)

    @property
    def right_ci95(self) -> tuple[float, float] | None:
        """Interval of the share of faults named correctly."""
        return _wilson(self.right, self.faulty)

    @property
    def wrong_ci95(self) -> tuple[float, float] | None:
        """Interval of the share of faults named wrongly."""
        return _wilson(self.wrong, self.faulty)

    @property
    def alarms_ci95(self) -> tuple[float, float] | None:
        """Interval of the share of healthy records for which a fault was named."""
        return _wilson(self.alarms, self.healthy)


def confusions(judged: Sequence[Judged]) -> Iterator[Confusion]:
    """Per method and answer: all data sets together, then each."""
    names = (ALL, *dict.fromkeys(j.dataset for j in judged))
    for method, answer, name in itertools.product(dict.fromkeys(j.method for j in judged), (NAMED, CALLED), names):
        own = [j for j in judged if j.method == method and name in (ALL, j.dataset)]
        pairs = Counter((j.state.value, (j.named if answer == NAMED else j.called) or NOTHING) for j in own)
        said = (NOTHING, *(fault.value for fault in DEFECTS))
        counts = {state.value: {one: pairs[state.value, one] for one in said} for state in Fault}
        yield Confusion(method=method, answer=answer, dataset=name, rigs=len({j.rig for j in own}), counts=counts)


def _text(confusions_: Sequence[Mapping[str, Any]], naming: Mapping[str, Any]) -> str:
    parts = []
    for row in confusions_:
        if row["dataset"] == ALL:
            counts = [{"state": state, **said} for state, said in row["counts"].items()]
            parts.append(f"{row['method']}, {row['answer']}:\n{printed_columns(__package__, 'counts', counts)}")
    for row in (naming["scores"], naming["wrongly_read"]):
        parts.append(", ".join(f"{name.replace('_', ' ')} {value:.4g}" for name, value in row.items()))
    methods_ = [{**row, **_per_cent(row)} for row in confusions_ if row["healthy"] + row["faulty"]]
    return "\n\n".join([*parts, printed_columns(__package__, "methods", methods_)])


def _per_cent(row: Mapping[str, Any]) -> dict[str, str]:
    """The intervals of a row in words."""
    shares = {"right_range": row["right_ci95"], "wrong_range": row["wrong_ci95"], "alarm_range": row["alarms_ci95"]}
    return {name: f"{100 * v[0]:.0f} to {100 * v[1]:.0f}" if v else "" for name, v in shares.items()}


def _run(_: Namespace, progress: Progress) -> StudyResult:
    """How often faults are diagnosed correctly; `DataError` where no record of known state is registered."""
    registered = listing().recordings
    records = known_records(registered)
    if not records:
        raise DataError(
            "no measured recording of known state is registered; register some with srbval data add DIR, or name their "
            "folder in SRBVAL_RECORDINGS."
        )
    judged = judge(records, methods(registered), progress=progress)
    content: dict[str, Any] = to_json(
        {"confusions": list(confusions(judged)), "naming": naming_scores(), "records": judged}
    )
    return StudyResult(name="diagnosis", content=content, text=_text(content["confusions"], content["naming"]))


STUDY = Study(
    question="How often are faults in the registered recordings diagnosed correctly, against two simple methods?",
    minutes=2, run=_run,
)  # fmt: skip
