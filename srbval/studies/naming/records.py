"""Registered recordings with a known bearing state, and the bearing from which each was recorded.

Each record is read with its stated speed and bearing. A faulty record is also read with the shaft speed changed by +20
% and -10 %, and as a record of another bearing; naming a part is then wrong.
"""

import dataclasses
import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from srbval.bearing import Bearing, Fault, load_bearing
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.manifest import FileStatus, RegisteredRecording, without_copies
from srbval.recordings.registry import load_entry, rig_of

WRONG_SPEEDS, WRONG_BEARINGS = (1.2, 0.9), ("mfpt-nice", "skf-6203")  # the second for records of the first
# The geometry of UESTC's insert is not published; a UC 204 is assumed, whose 8 balls its inner-race record fits.
ASSUMED_BEARING = {"uestc": "uc-204"}
HEALTHY_IMS = r"^2003\.10\.22\.12\."  # the first minutes of a run to failure of a month: four bearings, eight channels
SPECIMENS = {  # the bearing within its rig, in the names of the files
    "cwru": r"_((?:IR|OR|B)\d+|Normal).*_\d\d?k?(DE|FE)|_((?:IR|OR|B)\d+|Normal)",
    "hit-sm": r"^(Normal|IR\d|OR\d)",
    "mfpt": r"^(Inner|Outer|baseline)",
    "uestc": r"^([NBIO])_",
    "torino": r"^(H|IR|OR|Roller)_",
}


@dataclass(frozen=True, kw_only=True)
class KnownRecord:
    """Registered record with a known `state`; `specimen` names the tested bearing of its `rig`."""

    entry: RegisteredRecording
    state: Fault
    rig: str
    specimen: str

    def load(self) -> tuple[Recording, Bearing]:
        """Return the bearing, and the record without its state (damaged part); only one channel if settings name it."""
        recording = dataclasses.replace(load_entry(self.entry), state=None)
        channel = self.entry.settings and self.entry.settings.channel
        if channel:
            recording = dataclasses.replace(recording, channels={channel: recording.channels[channel]})
        return recording, load_bearing(ASSUMED_BEARING.get(self.entry.dataset or "") or recording.bearing or "")


def known_records(registered: Iterable[RegisteredRecording]) -> list[KnownRecord]:
    """Measured recordings with intact files and a known state, sorted by rig and file."""
    found = []
    for entry in without_copies(r for r in registered if r.dataset and r.origin is Origin.MEASURED):
        file, dataset = Path(entry.file), entry.dataset or ""
        whole, folder = rig_of(dataset, entry.file)
        rig = " ".join(filter(None, (whole, Path(folder).name)))
        if entry.status is not FileStatus.OK:
            continue
        if entry.state is not None:
            pattern = next((p for name, p in SPECIMENS.items() if dataset.startswith(name)), "(.*)")
            match = re.search(pattern, file.stem)
            specimen = "-".join(filter(None, match.groups())) if match else file.stem
            found.append(KnownRecord(entry=entry, state=entry.state, rig=rig, specimen=specimen))
        elif dataset == "ims" and re.search(HEALTHY_IMS, file.name):
            for number in range(8):
                own = dataclasses.replace(entry.settings or RecordingSettings(), channel=f"ch{number + 1}")
                one = dataclasses.replace(entry, channel=own.channel, settings=own)
                specimen = f"bearing {number // 2 + 1}"
                found.append(KnownRecord(entry=one, state=Fault.HEALTHY, rig=rig, specimen=specimen))
    return sorted(found, key=lambda r: (r.rig, r.entry.file, r.entry.channel or ""))


def otherwise(recording: Recording, bearing: Bearing) -> Iterator[tuple[Recording, Bearing]]:
    """Yield the record with each of two wrong speeds and no tachometer signal, then with a wrong bearing."""
    speed = recording.speed
    assert speed is not None, "every data set states a speed"
    for factor in WRONG_SPEEDS:
        wrong = dataclasses.replace(speed, value_hz=factor * speed.value_hz, ci95_hz=factor * speed.ci95_hz)
        yield dataclasses.replace(recording, speed=wrong, speed_signal=None), bearing
    yield recording, load_bearing(WRONG_BEARINGS[bearing.name == WRONG_BEARINGS[0]])
