"""Interpretation of files written by srbval (attribute ``srbval_kind``): runs and recordings."""

import dataclasses
import re

from srbval.errors import DataError, NoRecordingError, SrbvalError
from srbval.models.run import USABLE
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.reading import Channel, Reading
from srbval.recordings.recording import (
    KIND_ATTRIBUTE,
    RECORDING_KIND,
    SPEED_RATE,
    SPEED_TIME,
    SPEED_VARIABLE,
    Recording,
    SourceFacts,
    SpeedSignal,
)
from srbval.recordings.times import interpret_times
from srbval.storage.json_files import parse_json
from srbval.storage.tables import build

RUN_SIGNAL = re.compile("acceleration_(.+)_m_s2")  # in a run, the only signals of a recording; channels such as x
LONGEST_NOTE = 1000


def read_srbval_file(raw: RawFile) -> Reading | None:
    """Read a run or a recording that this program wrote; None for files of other programs."""
    if KIND_ATTRIBUTE not in raw.attributes:
        return None
    fs_hz, kind = raw.number("fs_hz"), raw.text(KIND_ATTRIBUTE)
    if fs_hz and "time_s" in raw.variables and (against := interpret_times(raw, "time_s").rate_caution(fs_hz)):
        raise DataError(
            f"{raw.path}: {against} by the attribute fs_hz. Set it to the rate of the stored samples. If only every "
            "nth sample of a signal was stored, low-pass filter the signal and store it again."
        )
    if kind not in ("run", RECORDING_KIND):
        raise NoRecordingError(f"{raw.path}: srbval_kind is {kind!r}; this version reads 'run', {RECORDING_KIND!r}.")
    status = raw.text("status") or "ok"
    if status not in USABLE:
        raise DataError(f"{raw.path}: the run failed ({status}: {raw.text('reason')}); it is not a vibration record.")
    names = {name: name for name in raw.arrays if name not in ("time_s", SPEED_TIME, SPEED_VARIABLE)}
    if kind == "run":
        names = {name: found[1] for name in names if (found := RUN_SIGNAL.fullmatch(name))}
    samples = {channel: raw.signal(name) for name, channel in names.items()}
    try:
        facts = parse_json(raw.text("facts") or "")
        stated = build(Recording, facts | {"channels": samples}, "facts")
    except (ValueError, TypeError, SrbvalError) as error:
        advice = " If another version of srbval wrote it, simulate it again." if kind == "run" else ""
        raise DataError(f"{raw.path}: the facts about the {kind} cannot be read ({error}).{advice}") from None
    # A path is ignored, so that no file makes the program open another file.
    named = re.fullmatch(r"[\w .+-]{1,80}", stated.bearing or "") and not (stated.bearing or "").endswith(".toml")
    unit = "V" if stated.scale_missing else stated.unit  # any unit, as its whole numbers are not used as amounts
    channels = {
        channel: Channel(
            samples=samples[channel],
            unit=unit,
            bearing=stated.bearing if named else None,
            band_hz=stated.band_hz,
            state=stated.state,
            variable=name,
            whole_numbers=stated.scale_missing,
        )
        for name, channel in names.items()
    }
    own = {field.name: getattr(stated, field.name) for field in dataclasses.fields(SourceFacts)}
    own |= {key: tuple(printable(text, LONGEST_NOTE) for text in own[key]) for key in ("notes", "cautions")}
    rate_hz = raw.number(SPEED_RATE)
    if rate_hz and SPEED_VARIABLE in raw.arrays:
        own["speed_signal"] = SpeedSignal(values_hz=raw.signal(SPEED_VARIABLE), rate_hz=rate_hz)
    return Reading(**own, channels=channels, fs_hz=stated.fs_hz, name=printable(stated.name))
