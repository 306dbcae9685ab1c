"""Recordings of public data sets from the package `bearing-datasets`, which downloads them and states what is known."""

import contextlib
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from srbval.bearing import Bearing, Fault, load_bearing
from srbval.errors import ConfigurationError, DataError
from srbval.recordings.load import recording_from_columns
from srbval.recordings.recording import Recording, SpeedSignal
from srbval.recordings.speed import tachometer_speed

if TYPE_CHECKING:
    import pandas

UNITS = {"acceleration": ("m/s^2", "m/s2"), "velocity": ("mm/s", "mm/s"), "displacement": ("um", "um")}  # theirs, ours
STATES = {"normal": Fault.HEALTHY, "inner": Fault.INNER, "outer": Fault.OUTER, "rolling_element": Fault.ROLLER}
NOT_STATED = (None, "none", "unknown")
SET_POINT_PCT = 1.5  # by which the shaft may be off a speed of which a set does not say that it was measured


def dataset_recordings(dataset: Any, rows: "pandas.DataFrame | None" = None, **stated: Any) -> list[Recording]:
    """Recordings of a `Dataset` of `bearing-datasets`, one per row, in their order, with the facts that it states.

    `rows` are those of its `metadata()`, by default all of vibrations. A speed is that of the channel of the speed
    recorded beside it, or else a set point kept within `SET_POINT_PCT`. What the set leaves open is asked for: a unit
    here, bearing and speed when they are needed. `stated` are fields of `RecordingSettings`, which go over the set's;
    only a `unit` holds for signals without one.
    """
    whole = dataset.metadata()
    kinds = whole["quantity"] if "quantity" in whole else whole["fs"].map(lambda _: "unknown")
    own = whole[kinds.isin([*UNITS, "unknown"])] if rows is None else rows
    facts = [{key: value for key, value in row.items() if value not in NOT_STATED} for row in own.to_dict("records")]
    speeds = [one for one in whole[kinds == "speed"].to_dict("records") if "rpm" not in stated]
    return [_recording(dataset, one, speeds, stated) for one in facts]


def _recording(
    dataset: Any, facts: Mapping[str, Any], speeds: list[dict[str, Any]], stated: Mapping[str, Any]
) -> Recording:
    """Recording of the signal with these `facts`, at the speed of its channel among `speeds` if there is one."""
    identity, channel, given = facts["signal_id"], facts["channel"], {"fs_hz": facts["fs"], **stated}
    theirs, ours = UNITS.get(facts.get("quantity", ""), (None, None))
    try:
        samples = dataset.signal(identity, unit=theirs)
    except ValueError:  # raw values of no stated unit
        samples, ours = dataset.signal(identity), None
    if ours:
        given.pop("unit", None)
    notes = [f"data set {dataset.name} of bearing-datasets, label {facts.get('native_label', 'none')}"]
    fault, places = facts.get("fault_type"), [facts.get(f"{of}_location") for of in ("sensor", "fault")]
    if fault == "normal" or facts.get("sensor_at_fault") or None in places:
        given.setdefault("state", STATES.get(fault or ""))
    elif fault:
        notes.append(f"the fault, {fault}, is at {places[1]}, not at this sensor's {places[0]}")
    if "speed_rpm" in facts and "rpm" not in stated:
        given |= {"rpm": facts["speed_rpm"], "rpm_tolerance_pct": SET_POINT_PCT}
    try:
        given = {"bearing": _bearing(facts, dataset.name)} | given
    except ConfigurationError as error:
        notes.append(f"the bearing, {facts.get('bearing_model', 'of orders')}, is left open: {error}")
    known: dict[str, Any] = {"name": f"{dataset.name} {identity}", "column_units": {channel: ours} if ours else {}}
    recording = recording_from_columns({channel: samples}, **known, channel=channel, **given)
    found: dict[str, Any] = {"notes": tuple(notes)}
    for speed in (one for one in speeds if one["recording_id"] == facts["recording_id"]):
        with contextlib.suppress(DataError, ValueError):  # a shaft at rest, or no unit
            signal = SpeedSignal(values_hz=dataset.signal(speed["signal_id"], unit="Hz"), rate_hz=speed["fs"])
            found |= {"speed_signal": signal, "speed": tachometer_speed(signal.values_hz, signal.rate_hz)}
    if (profile := facts.get("speed_profile", "constant")) != "constant" and "speed" not in found:
        found["cautions"] = (*recording.cautions, f"speed {profile}, and its course is not recorded")
    return replace(recording, **found)


def _bearing(facts: Mapping[str, Any], dataset: str) -> Bearing | None:
    """Bearing by its orders, else by its designation; None if the set states neither; raises as `load_bearing`."""
    model, orders = facts.get("bearing_model"), [str(facts.get(key)) for key in ("bpfo", "bpfi", "bsf", "ftf")]
    if "None" in orders:
        return load_bearing(model) if model else None
    title = f"{model or 'bearing'}, by the orders in data set {dataset}"
    return replace(load_bearing(f"orders {','.join(orders)}"), title=title)
