"""Registered recordings of known state, which bearing of its rig each is of, and the features that they teach.

Each is read once as what it is; a faulty one also with a shaft speed wrong by 13 % and by -10 % and with another
bearing, which must come out as something else.
"""

import dataclasses
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.diagnosis.fault_posterior import OTHER
from srbval.diagnosis.fault_scores import fault_scores
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.registry import FileStatus, RegisteredRecording, load_entry, rig_of, without_copies
from srbval.storage.tables import read_toml

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
class KnownFeatures:
    """Features [4] of a record of known state, one of `CLASSES`, and where it is from; stored with the result."""

    rig: str
    specimen: str
    state: str
    features: tuple[float, ...]


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


def readings(state: Fault, read: Analysis) -> list[tuple[str, Analysis]]:
    """The record as `read`, of its `state`, and of a faulty one also as what it is not, as something else."""
    found = [(state.value, read)]
    if state in DEFECTS:
        for factor in WRONG_SPEEDS:
            value_hz, ci95_hz = factor * read.speed.value_hz, factor * read.speed.ci95_hz
            wrong = dataclasses.replace(read.speed, value_hz=value_hz, ci95_hz=ci95_hz)
            found.append((OTHER, dataclasses.replace(read, speed=wrong)))
        other = load_bearing(WRONG_BEARING.get(read.bearing.name, next(iter(WRONG_BEARING))))
        found.append((OTHER, dataclasses.replace(read, bearing=other)))
    return found


def features_of(record: KnownRecord, state: str, read: Analysis) -> KnownFeatures:
    """Those of one of the `readings` of a record."""
    found = tuple(round(value, 2) for value in fault_scores(read).features)
    return KnownFeatures(rig=record.rig, specimen=specimen(record), state=state, features=found)
