"""How often faults are diagnosed correctly on machines nobody tuned to: records of known state, by several methods.

No method sees the state that a record's name or data set declares.
"""

import dataclasses
import itertools
import re
import time
import tomllib
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import ClassVar

from scipy.stats import binomtest

from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.comparison.other_rigs import Baselines, healthy_analysis
from srbval.diagnosis.fault_call import call_fault
from srbval.diagnosis.fault_naming import name_fault
from srbval.errors import SrbvalError
from srbval.progress import Progress, silent
from srbval.reading.analyse import analyse
from srbval.reading.band_choice import band_kurtogram, declared_band
from srbval.reading.lines import detected_fault_lines
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.registry import FileStatus, RegisteredRecording, load_entry, rig_of, without_copies
from srbval.studies.diagnosis.simple_diagnosis import strongest_line

ALL = "all"
NAMED, CALLED = "first named", "called"
NOTHING = "nothing"


@dataclass(frozen=True, kw_only=True)
class KnownRecord:
    """A registered record of known `state`, to be read with the settings of `entry`; `bearing` None: its set's own."""

    entry: RegisteredRecording
    state: Fault
    bearing: str | None = None

    def load(self) -> tuple[Recording, Bearing]:
        """The record without its state, and its bearing; raises what loading raises.

        Without the other channels where the entry asks for one: those are other bearings'.
        """
        recording = dataclasses.replace(load_entry(self.entry), state=None)
        asked = self.entry.settings and self.entry.settings.channel
        if asked:
            recording = dataclasses.replace(recording, channels={asked: recording.channels[asked]})
        return recording, load_bearing(self.bearing or recording.bearing or "")

    @property
    def rig(self) -> str:
        """The machine: data set and, where that holds several, folder."""
        dataset, folder = rig_of(self.entry.dataset, self.entry.file)
        return " ".join(filter(None, (dataset, Path(folder).name)))


def known_records(registered: Iterable[RegisteredRecording]) -> list[KnownRecord]:
    """Those of `registered` that are measured, whole and of known state, in the order of rig and file."""
    assumed = tomllib.loads((resources.files("srbval.studies.diagnosis") / "assumed.toml").read_text(encoding="utf-8"))
    found = []
    for entry in without_copies(r for r in registered if r.dataset and r.origin is Origin.MEASURED):
        if entry.status is not FileStatus.OK:
            continue
        bearing, dataset = assumed["bearing"].get(entry.dataset), entry.dataset
        if entry.state is not None:
            found.append(KnownRecord(entry=entry, state=entry.state, bearing=bearing))
        for rule in assumed["healthy"]:
            if entry.state is None and rule["dataset"] == dataset and re.search(rule["file"], Path(entry.file).name):
                settings = entry.settings or RecordingSettings()
                found += [
                    KnownRecord(
                        entry=dataclasses.replace(
                            entry, channel=name, settings=dataclasses.replace(settings, channel=name)
                        ),
                        state=Fault.HEALTHY,
                        bearing=bearing,
                    )
                    for name in rule["channels"]
                ]
    return sorted(found, key=lambda r: (r.rig, r.entry.file, r.entry.channel or ""))


@dataclass(frozen=True, kw_only=True)
class Named:
    """What a method says of a record: the fault it names first, and the one it calls; None: neither."""

    named: Fault | None
    called: Fault | None


Method = Callable[[str, Recording, Bearing], Named]  # of the rig's name, the record and its bearing


def methods(registered: Sequence[RegisteredRecording]) -> dict[str, Method]:
    """The ways of naming, by name; `registered` holds the healthy records that a call is made against.

    "joint test": the most probable class, called where it is probable enough, by the record alone against records of
    known state of other rigs (`name_fault`). "lines": the fault lines that `analyse` detects, the deepest named first,
    called against the healthy record of the same point; in the data set's band, or in one chosen on the record. The
    plain ones call whatever they name.
    """
    baselines = Baselines()

    def by_lines(recording: Recording, bearing: Bearing, *, choose: bool) -> Named:
        analysis = analyse(recording, bearing=bearing, choose_on_record=choose)
        deepest = next((Fault.of_line(line.name) for line in detected_fault_lines(analysis.lines)), None)
        band_hz = analysis.processed.band_hz if choose else None
        call = call_fault(analysis, healthy_analysis(recording, bearing, registered, baselines, band_hz))
        return Named(named=deepest, called=call.called)

    def jointly(rig: str, recording: Recording, bearing: Bearing) -> Named:
        naming = name_fault(analyse(recording, bearing=bearing), all_channels=True, without_rig=rig)
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
