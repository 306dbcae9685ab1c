"""Interpretation of the variables of a file as a `Reading`: channels, sampling rate, speed, load and bearing."""

from collections.abc import Mapping
from dataclasses import replace

from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.datasets.generic import read_generic, with_named_signals
from srbval.recordings.datasets.known import READERS
from srbval.recordings.datasets.srbval_files import read_srbval_file
from srbval.recordings.raw import RawFile
from srbval.recordings.reading import Channel, Reading, sample_cautions
from srbval.recordings.recording import Origin
from srbval.recordings.times import time_column


def recognise(raw: RawFile) -> Reading:
    """Interpret a file as written by srbval, else as part of a known data set, else by the names of its variables."""
    own = read_srbval_file(raw)
    known = (READERS[description.reader](raw, description) for description in known_datasets())
    reading = own or next((one for one in known if one is not None), None)
    if reading is None:
        raw = with_named_signals(raw)
        reading = read_generic(raw)
    if "simul" in (raw.text("origin") or "").lower():
        reading = replace(reading, origin=Origin.SIMULATED)
    channels: Mapping[str, Channel] = reading.channels
    if own is None and reading.origin is Origin.MEASURED:
        sound = {k: sample_cautions(c.samples) for k, c in channels.items() if not c.problem}
        channels = {k: replace(c, cautions=c.cautions + sound.get(k, ())) for k, c in channels.items()}
    if own is None:
        counts = {channel.samples.size for channel in channels.values()}
        times = {count: time for count in counts if (time := time_column(raw, count)) is not None}
        reading = replace(reading, times=times)
    notes, cautions = reading.notes + raw.notes, reading.cautions + raw.cautions
    return replace(reading, channels=channels, notes=notes, cautions=cautions)
