"""Recordings of the public data sets of the package `bearing-datasets`, which downloads them and states what is known.

A set that it has built is a table with a row per signal, and the samples; see its documentation for the columns.
"""

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from srbval.bearing import Bearing, Fault, load_bearing
from srbval.errors import ConfigurationError, DataError, SrbvalError
from srbval.recordings.load import recording_from_columns
from srbval.recordings.recording import Recording, SpeedSignal
from srbval.recordings.settings import with_keywords
from srbval.recordings.speed import tachometer_speed
from srbval.storage.installation import MissingLibraryError

if TYPE_CHECKING:
    import pandas

UNITS = {"acceleration": ("m/s^2", "m/s2"), "velocity": ("mm/s", "mm/s"), "displacement": ("um", "um")}  # theirs, ours
STATES = {"normal": Fault.HEALTHY, "inner": Fault.INNER, "outer": Fault.OUTER, "rolling_element": Fault.ROLLER}
NOT_STATED = (None, "none", "unknown")
SET_POINT_PCT = 1.5  # by which the shaft may be off a speed of which a set does not say that it was measured


def dataset_recordings(
    dataset: Any, rows: "pandas.DataFrame | None" = None, *, root: str | Path | None = None, **stated: Any
) -> Iterator[Recording]:
    """Recordings of a data set: its name if `bearing-datasets` has built it, or its `Dataset`; one per row, in order.

    `rows` are those of its `metadata()`, by default all of vibrations. Facts are those of the set. A speed is that of
    the channel of the speed recorded beside it, or else a set point kept within `SET_POINT_PCT`. What the set leaves
    open is asked for: a unit here, bearing and speed when they are needed. `stated` are fields of `RecordingSettings`,
    which go over the set's; only a `unit` holds for signals without one. Raises `DataError` if the set is not built.
    """
    if isinstance(dataset, str):
        try:
            import bearing_datasets

            dataset = bearing_datasets.open(dataset, root)
        except ImportError:
            raise MissingLibraryError(f"data set {dataset!r}", "bearing-datasets") from None
        except (FileNotFoundError, ValueError) as error:
            raise DataError(f"data set {dataset!r}: {error}") from None
    whole = dataset.metadata()
    kinds = whole["quantity"] if "quantity" in whole else whole["fs"].map(lambda _: "unknown")
    said = dataset.columns().set_index("column")["description"]
    for row in (whole[kinds.isin([*UNITS, "unknown"])] if rows is None else rows).to_dict("records"):
        facts = {key: value for key, value in row.items() if value not in NOT_STATED and value == value}
        try:
            recording = _recording(dataset, facts, stated)
        except SrbvalError as error:
            error.args = (with_keywords(str(error)),)
            raise
        beside = whole[(kinds == "speed") & (whole["recording_id"] == row["recording_id"])]
        notes, changes = [*recording.notes, f"speed_rpm: {said.get('speed_rpm')}"], dict[str, Any]()
        for speed in beside.to_dict("records") if "rpm" not in stated else ():
            with contextlib.suppress(DataError, ValueError):  # a shaft at rest, or no unit
                signal = SpeedSignal(values_hz=dataset.signal(speed["signal_id"], unit="Hz"), rate_hz=speed["fs"])
                changes = {"speed_signal": signal, "speed": tachometer_speed(signal.values_hz, signal.rate_hz)}
        if (profile := facts.get("speed_profile", "constant")) != "constant" and not changes:
            changes["cautions"] = (*recording.cautions, f"speed {profile}, and its course is not recorded")
        yield replace(recording, notes=tuple(notes), **changes)


def _recording(dataset: Any, facts: Mapping[str, Any], stated: Mapping[str, Any]) -> Recording:
    """Recording of the signal with these `facts`, its speed as a set point."""
    identity, channel, given = facts["signal_id"], facts["channel"], {"fs_hz": facts["fs"], **stated}
    theirs, ours = UNITS.get(facts.get("quantity", ""), (None, None))
    try:
        samples = dataset.signal(identity, unit=theirs)
    except ValueError:  # raw values of no stated unit
        samples, ours = dataset.signal(identity), None
    if ours:
        given.pop("unit", None)
    notes = [f"data set {dataset.name} of bearing-datasets, label {facts.get('native_label', 'none')}"]
    notes += [f"{key} {value} given by the user" for key, value in stated.items()]
    fault, places = facts.get("fault_type"), [facts.get(f"{of}_location") for of in ("sensor", "fault")]
    if fault == "normal" or facts.get("sensor_at_fault") or None in places:
        given.setdefault("state", STATES.get(fault or ""))
    elif fault:
        notes.append(f"the fault, {fault}, is at {places[1]}, not at this sensor's {places[0]}")
    if "speed_rpm" in facts and "rpm" not in stated:
        given |= {"rpm": facts["speed_rpm"], "rpm_tolerance_pct": SET_POINT_PCT}
    if "bearing" not in stated:
        try:
            given["bearing"] = _bearing(facts, dataset.name)
        except ConfigurationError as error:
            notes.append(f"bearing {facts.get('bearing_model', '')} is left open: {error}")
    name = f"{dataset.name} {identity}"
    recording = recording_from_columns(
        {channel: samples}, name=name, column_units={channel: ours} if ours else None, channel=channel, **given
    )
    return replace(recording, notes=tuple(notes))


def _bearing(facts: Mapping[str, Any], dataset: str) -> Bearing | None:
    """Bearing by its orders, else by its designation; None if the set states neither; raises as `load_bearing`."""
    model, orders = facts.get("bearing_model"), [str(facts.get(key)) for key in ("bpfo", "bpfi", "bsf", "ftf")]
    if "None" in orders:
        return load_bearing(model) if model else None
    title = f"{model or 'bearing'}, by the orders in data set {dataset}"
    return replace(load_bearing(f"orders {','.join(orders)}"), title=title)
