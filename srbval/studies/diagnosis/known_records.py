"""Registered recordings of known state, which bearing of its rig each is of, and the features that they teach.

Each is read once as what it is; a faulty one also with a shaft speed wrong by 13 % and by -10 % and with another
bearing, which must come out as something else. `write_table` makes ``srbval/diagnosis/known_records.csv`` of them.
"""

import contextlib
import csv
import dataclasses
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.diagnosis.fault_posterior import OTHER
from srbval.diagnosis.fault_scores import fault_scores
from srbval.errors import SrbvalError
from srbval.progress import Progress
from srbval.reading.analyse import Analysis, analyse
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.registry import FileStatus, RegisteredRecording, load_entry, rig_of, without_copies
from srbval.storage.tables import read_toml

COLUMNS = ("rig", "specimen", "state", *(fault.value for fault in DEFECTS), "unexplained")
HEAD = "# Features of records of known state; written by srbval study run diagnosis --table FILE\n"
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
    assumed, found = read_toml(Path(__file__).with_name("known_state.toml")), []
    for entry in without_copies(r for r in registered if r.dataset and r.origin is Origin.MEASURED):
        if entry.status is not FileStatus.OK:
            continue
        bearing, settings = assumed["bearing"].get(entry.dataset), entry.settings or RecordingSettings()
        if entry.state is not None:
            found.append(KnownRecord(entry=entry, state=entry.state, bearing=bearing))
            continue
        for rule in assumed["healthy"]:
            if rule["dataset"] == entry.dataset and re.search(rule["file"], Path(entry.file).name):
                for name in rule["channels"]:
                    own = dataclasses.replace(settings, channel=name)
                    of_channel = dataclasses.replace(entry, channel=name, settings=own)
                    found.append(KnownRecord(entry=of_channel, state=Fault.HEALTHY, bearing=bearing))
    return sorted(found, key=lambda r: (r.rig, r.entry.file, r.entry.channel or ""))


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
            value_hz, ci95_hz = factor * read.speed.value_hz, factor * read.speed.ci95_hz
            wrong = dataclasses.replace(read.speed, value_hz=value_hz, ci95_hz=ci95_hz)
            yield OTHER, dataclasses.replace(read, speed=wrong)
        other = load_bearing(WRONG_BEARING.get(read.bearing.name, next(iter(WRONG_BEARING))))
        yield OTHER, dataclasses.replace(read, bearing=other)


def write_table(file: Path, records: Iterable[KnownRecord], progress: Progress) -> list[dict[str, str]]:
    """Write the features of `records` to a CSV `file`, those that cannot be read left out; returns its rows."""
    known, found = list(records), []
    for number, record in enumerate(known):
        progress("read the records", number / len(known))
        with contextlib.suppress(SrbvalError):
            recording, bearing = record.load()
            for state, analysis in readings(record, analyse(recording, bearing=bearing)):
                values = (f"{value:.2f}" for value in fault_scores(analysis).features)
                found.append(dict(zip(COLUMNS, (record.rig, specimen(record), state, *values), strict=True)))
    progress("read the records", 1.0)
    with file.open("w", newline="", encoding="utf-8") as stream:
        stream.write(HEAD)
        writer = csv.DictWriter(stream, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
    return found
