"""Registered recordings of known state, and which bearing of its rig each is of."""

import dataclasses
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from srbval.bearing import DEFECTS, Bearing, Fault, load_bearing
from srbval.diagnosis.fault_posterior import OTHER
from srbval.reading.analyse import Analysis
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.registry import FileStatus, RegisteredRecording, load_entry, rig_of, without_copies


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
    assumed = tomllib.loads((resources.files("srbval.studies") / "known_state.toml").read_text(encoding="utf-8"))
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
