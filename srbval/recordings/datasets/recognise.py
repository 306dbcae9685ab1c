"""From named variables to a `Reading`: this program's own files, known data sets, then plain files."""

from __future__ import annotations

from collections.abc import Callable

from srbval.recordings.datasets.cwru import read_cwru
from srbval.recordings.datasets.description import DatasetDescription, known_datasets
from srbval.recordings.datasets.own import is_own, read_own
from srbval.recordings.datasets.plain import read_plain
from srbval.recordings.datasets.signal_structs import read_signal_structs
from srbval.recordings.datasets.variables import read_variables
from srbval.recordings.raw import RawFile
from srbval.recordings.reading import Reading

Reader = Callable[[RawFile, DatasetDescription], Reading | None]
READERS: dict[str, Reader] = {
    "variables": read_variables,
    "signal-structs": read_signal_structs,
    "cwru": read_cwru,
}


def recognise(raw: RawFile) -> Reading:
    """The first description that fits decides; a file that fits none is read as plain named vectors.

    Raises `DataError` where a file is of a known kind but damaged, or holds no vibration signal at all.
    """
    if is_own(raw):
        return read_own(raw)
    for description in known_datasets():
        reading = READERS[description.reader](raw, description)
        if reading is not None:
            return reading
    return read_plain(raw)
