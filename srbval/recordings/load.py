"""Functions that create a `Recording` from a file, from arrays, from a simulated run or from a public data set."""

import contextlib
import dataclasses
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from srbval.bearing import Bearing, Fault, load_bearing
from srbval.errors import ConfigurationError, DataError, OpenQuestion, SrbvalError
from srbval.models.run import Run
from srbval.models.run_file import profile_signal, signal_facts
from srbval.recordings.datasets.description import dataset, known_datasets
from srbval.recordings.datasets.generic import read_generic, with_named_signals
from srbval.recordings.datasets.known import READERS
from srbval.recordings.datasets.srbval_files import read_srbval_file
from srbval.recordings.loaders import detect_format
from srbval.recordings.raw import RawFile, printable
from srbval.recordings.reading import Channel, Reading, sample_cautions
from srbval.recordings.recording import SPEED_VARIABLE, Origin, Recording, SourceFacts, SpeedSignal
from srbval.recordings.settings import (
    NAMED_CHANNELS,
    RecordingSettings,
    apply_settings,
    open_for_analysis,
    open_questions,
    settings_of,
)
from srbval.recordings.speed import tachometer_speed
from srbval.recordings.times import time_column
from srbval.storage.files import file_sha256
from srbval.storage.json_files import parse_json
from srbval.storage.tables import build

if TYPE_CHECKING:
    import pandas


def load_recording(path: str | Path, settings: RecordingSettings | None = None, **stated: Any) -> Recording:
    """Load a measured, simulated or synthetic record from a file; settings stored by `srbval data add` do not apply.

    `stated` are fields of `RecordingSettings`, which take precedence over `settings`. Raises `DataError` for a file
    that cannot be read or is ambiguous, `ConfigurationError` for an impossible setting.
    """
    file = Path(path)
    reading = read_file(file, settings_of(stated).over(settings or RecordingSettings()))
    named = {"name": printable(file.stem), "file": str(file), "sha256": file_sha256(file)}
    return _assemble(reading, subject_of(file), named)


def recording_from_columns(
    columns: Mapping[str, NDArray[Any]],
    *,
    name: str = "recording",
    bearing: Bearing | str | Path | None = None,
    column_units: Mapping[str, str] | None = None,
    attributes: Mapping[str, Any] | None = None,
    **stated: Any,
) -> Recording:
    """Create a recording from named arrays, interpreted like the columns of a file.

    Times are recognised by their name, units by titles such as ``acc [g]``. `bearing` is a name, a file or a `Bearing`;
    `column_units` maps columns to units, `attributes` are facts by name, such as ``rpm``. `stated` are fields of
    `RecordingSettings`, such as `fs_hz`, `unit`, `rpm`, `channel`. Raises the errors of `load_recording`.
    """
    own = None if bearing is None else load_bearing(bearing)
    settings = settings_of(stated | {"bearing": bearing.name if isinstance(bearing, Bearing) else bearing})
    numbers = {key: values for key, values in columns.items() if values.dtype.kind in "fiubmM"}
    dates = {key: values for key, values in numbers.items() if values.dtype.kind in "mM"}
    numbers |= {key: (values - values.flat[0]) / np.timedelta64(1, "s") for key, values in dates.items()}
    given = {key: value for key, value in (attributes or {}).items() if isinstance(value, str | int | float)}
    units = dict(column_units or {}) | dict.fromkeys(dates, "s")
    raw = RawFile(path=Path(name), format="array", variables=numbers, attributes=given, units=units)
    reading = apply_settings(raw.path, recognise(raw), settings)
    kept = parse_json(str(given.get("facts", "{}")))  # of `Recording.facts`
    named = {"name": name} | {key: kept[key] for key in ("file", "sha256") if kept.get(key)}
    return _assemble(dataclasses.replace(reading, own_bearing=own or reading.own_bearing), name, named)


def with_settings(recording: Recording, settings: RecordingSettings) -> Recording:
    """Apply the user's settings to a recording; without settings, return the recording unchanged."""
    if not settings:
        return recording
    columns, course = {**recording.channels}, recording.speed_signal
    columns |= {SPEED_VARIABLE: course.values_hz} if course is not None else {}
    return recording_from_columns(columns, name=recording.name, attributes=recording.facts(), **vars(settings))


def questions_error(
    kind: type[SrbvalError], subject: str, questions: Sequence[OpenQuestion], remedy: str = ""
) -> SrbvalError:
    """Create an error of class `kind` that lists open `questions` about `subject` (a file or record), and `remedy`."""
    error = kind(f"{subject} lacks information: {'; '.join(map(str, questions))}.{remedy}")
    error.subject, error.questions = subject, tuple(questions)
    return error


def subject_of(path: Path) -> str:
    """Path and format of a file in words, as the `subject` of `questions_error`."""
    return f"{path} ({detect_format(path).name})"


def open_channels(path: Path, settings: RecordingSettings) -> tuple[str, ...]:
    """Channels from which the user must choose one to analyse; empty if the file or `settings` determine it."""
    reading = read_file(path, settings)
    is_open = reading.channel is None and reading.axes is None
    return tuple(reading.vibrations or reading.channels) if is_open else ()


def recording_from_run(run: Run) -> Recording:
    """Create a recording of a run, even a failed one: outer ring accelerations and any simulated sensor signal."""
    channels = {axis: np.ascontiguousarray(run.acceleration_m_s2[:, i]) for i, axis in enumerate("xyz")}
    channels |= {"sensor": run.sensor_m_s2} if run.sensor_m_s2.size else {}
    known = signal_facts(run, sensor="sensor" in channels) | {"channels": channels}
    profile = profile_signal(run)
    signal = None if profile is None else SpeedSignal(values_hz=profile[0], rate_hz=profile[1])
    return dataclasses.replace(build(Recording, known, "run"), speed_signal=signal)


def read_file(path: Path, settings: RecordingSettings) -> Reading:
    """Read and interpret a file; channel and sampling rate are None if neither file nor `settings` determine them."""
    try:
        return apply_settings(path, recognise(detect_format(path).load(path)), settings)
    except OSError as error:  # deleted meanwhile, a failing disk, or no memory to map the file
        raise DataError(f"{path}: cannot be read ({error.strerror}).") from None


def recognise(raw: RawFile) -> Reading:
    """Interpret a file as written by srbval, else as part of a known data set, else by the names of its variables."""
    own = read_srbval_file(raw)
    known = (READERS[description.reader](raw, description) for description in known_datasets())
    reading = own or next((one for one in known if one is not None), None)
    if reading is None:
        raw = with_named_signals(raw)
        reading = read_generic(raw)
    if "simul" in (raw.text("origin") or "").lower():
        reading = dataclasses.replace(reading, origin=Origin.SIMULATED)
    channels: Mapping[str, Channel] = reading.channels
    if own is None and reading.origin is Origin.MEASURED:
        sound = {k: sample_cautions(c.samples) for k, c in channels.items() if not c.problem}
        channels = {k: dataclasses.replace(c, cautions=c.cautions + sound.get(k, ())) for k, c in channels.items()}
    counts = {channel.samples.size for channel in channels.values()} if own is None else ()
    times = {count: time for count in counts if (time := time_column(raw, count)) is not None}
    notes, cautions = reading.notes + raw.notes, reading.cautions + raw.cautions
    return dataclasses.replace(reading, channels=channels, times=times, notes=notes, cautions=cautions)


def _assemble(reading: Reading, subject: str, named: dict[str, str]) -> Recording:
    """Create a recording from `reading`; `named` contains its name, file and hash, `subject` is for error messages."""
    reading.check_main()
    if (questions := open_questions(reading)) or reading.fs_hz is None:
        remedy = " State them here, or store them with the file once, by `srbval data add`."
        raise questions_error(DataError, subject, (*questions, *open_for_analysis(reading)), remedy)
    main = reading.main
    kind = len(main.samples), main.fs_hz, main.recording_unit
    same = {
        key: c
        for key, c in reading.channels.items()
        if (len(c.samples), c.fs_hz, c.recording_unit) == kind and not c.problem
    }
    left = [printable(key) for key in reading.channels if key not in same][:NAMED_CHANNELS]
    notes = (f"left out, of another length, rate or unit: {', '.join(left)}",) if left else ()
    band_hz = main.band_hz or (dataset(reading.dataset).band_hz(reading.fs_hz) if reading.dataset else None)
    facts = {f.name: getattr(reading, f.name) for f in dataclasses.fields(SourceFacts)}
    facts |= {"cautions": reading.all_cautions(), "notes": reading.notes + notes}
    facts |= {key: getattr(main, key) for key in ("bearing", "state", "scale_missing")}
    facts |= named | {"name": reading.name or named["name"]}
    return Recording(
        **facts,
        channels={key: c.converted() for key, c in same.items()},
        fs_hz=reading.fs_hz,
        unit=main.recording_unit,
        band_hz=band_hz,
    )


# Units and states of public data sets.
SET_UNITS = {"acceleration": "m/s^2", "velocity": "mm/s", "displacement": "um"}
SET_STATES = {"normal": Fault.HEALTHY, "inner": Fault.INNER, "outer": Fault.OUTER, "rolling_element": Fault.ROLLER}
NOT_STATED = (None, "none", "unknown")
SET_POINT_PCT = 1.5  # tolerance of a speed, unless the data set states that the speed was measured


def dataset_recordings(public_set: Any, rows: "pandas.DataFrame | None" = None, **stated: Any) -> list[Recording]:
    """Create a recording from each row of metadata of `public_set`, a `Dataset` of the package `bearing-datasets`.

    `rows` are rows of the set's `metadata()`, by default all vibration signals. The shaft speed is taken from the speed
    signal recorded with the vibration; without one it is the set point, with a tolerance of `SET_POINT_PCT` [%].
    `stated` are fields of `RecordingSettings`, which take precedence over the data set, except for `unit`: if the set
    states the unit of a signal, `unit` is ignored, otherwise it is required. Bearing and speed may remain unknown, but
    some analyses need them.
    """
    whole = public_set.metadata()
    kinds = whole["quantity"] if "quantity" in whole else whole["fs"].map(lambda _: "unknown")
    own = whole[kinds.isin([*SET_UNITS, "unknown"])] if rows is None else rows
    facts = [{key: value for key, value in row.items() if value not in NOT_STATED} for row in own.to_dict("records")]
    speeds = [one for one in whole[kinds == "speed"].to_dict("records") if "rpm" not in stated]
    return [_recording_of_row(public_set, one, speeds, stated) for one in facts]


def _recording_of_row(
    public_set: Any, facts: Mapping[str, Any], speeds: list[dict[str, Any]], stated: Mapping[str, Any]
) -> Recording:
    """Create the recording of a metadata row (`facts`); `speeds` are the rows of all speed signals of the data set."""
    identity, channel, given = facts["signal_id"], facts["channel"], {"fs_hz": facts["fs"], **stated}
    unit = SET_UNITS.get(facts.get("quantity", ""))
    try:
        samples = public_set.signal(identity, unit=unit)
    except ValueError:  # raw values of no stated unit
        samples, unit = public_set.signal(identity), None
    if unit:
        given.pop("unit", None)
    notes = [f"data set {public_set.name} of bearing-datasets, label {facts.get('native_label', 'none')}"]
    fault, places = facts.get("fault_type"), [facts.get(f"{of}_location") for of in ("sensor", "fault")]
    if fault == "normal" or facts.get("sensor_at_fault") or None in places:
        given.setdefault("state", SET_STATES.get(fault or ""))
    elif fault:
        notes.append(f"the fault, {fault}, is at {places[1]}, not at this sensor's {places[0]}")
    if "speed_rpm" in facts and "rpm" not in stated:
        given |= {"rpm": facts["speed_rpm"], "rpm_tolerance_pct": SET_POINT_PCT}
    try:
        given = {"bearing": _bearing_of_set(facts, public_set.name)} | given
    except ConfigurationError as error:
        notes.append(f"the bearing, {facts.get('bearing_model', 'of orders')}, is left open: {error}")
    known: dict[str, Any] = {"name": f"{public_set.name} {identity}", "column_units": {channel: unit} if unit else {}}
    recording = recording_from_columns({channel: samples}, **known, channel=channel, **given)
    found: dict[str, Any] = {"notes": tuple(notes)}
    for speed in (one for one in speeds if one["recording_id"] == facts["recording_id"]):
        with contextlib.suppress(DataError, ValueError):  # a shaft at rest, or no unit
            signal = SpeedSignal(values_hz=public_set.signal(speed["signal_id"], unit="Hz"), rate_hz=speed["fs"])
            found |= {"speed_signal": signal, "speed": tachometer_speed(signal.values_hz, signal.rate_hz)}
    if (profile := facts.get("speed_profile", "constant")) != "constant" and "speed" not in found:
        found["cautions"] = (*recording.cautions, f"speed {profile}, and its course is not recorded")
    return dataclasses.replace(recording, **found)


def _bearing_of_set(facts: Mapping[str, Any], dataset: str) -> Bearing | None:
    """Bearing by the fault orders in a metadata row (`facts`), else by the bearing's designation in it, else None."""
    model, orders = facts.get("bearing_model"), [str(facts.get(key)) for key in ("bpfo", "bpfi", "bsf", "ftf")]
    if "None" in orders:
        return load_bearing(model) if model else None
    title = f"{model or 'bearing'}, by the orders in data set {dataset}"
    return dataclasses.replace(load_bearing(f"orders {','.join(orders)}"), title=title)
