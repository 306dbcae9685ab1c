"""Predictions of rig records that were stored before these were compared, and their comparison."""

import hashlib
import json
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from srbval.bearing import RACE_DEFECTS, Bearing, Fault
from srbval.comparison.compared_quantities import CAGE_RATIO, cage_of
from srbval.comparison.comparison import Comparison, QuantityValue
from srbval.errors import SrbvalError
from srbval.path.amplitudes import levels, pattern
from srbval.reading.analyse import analyse
from srbval.recordings import Recording
from srbval.recordings.registry import RegisteredRecording, load_entry, rig_recordings, unopened
from srbval.studies.rig_amplitudes import rows


def digest(predictions: Sequence[Mapping[str, Any]]) -> str:
    """SHA-256 of the predictions as JSON with sorted keys and without blanks."""
    text = json.dumps(predictions, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("utf-8")).hexdigest()


def values_of_record(
    record: Recording, healthy: Recording | None, state: Fault, bearing: Bearing
) -> dict[str, QuantityValue]:
    """Levels of a rig record's increment over the `healthy` one, its envelope's pattern, a race defect's cage ratio.

    Without a healthy record there are no levels; where the line is not detected the pattern is read at its kinematic
    order, and there is no cage ratio. Raises what `analyse` raises.
    """
    found = analyse(record, bearing=bearing)
    line, speed = found.line_of(state), found.speed
    found_hz = line.found_hz if line.detected and line.found_hz else line.kinematic_hz
    order = found_hz / speed.value_hz
    read = {} if healthy is None else levels(record, healthy)
    read |= pattern(record, bearing, state, order)
    if line.detected and line.ci95_hz is not None and state in RACE_DEFECTS:
        width = order * math.hypot(line.ci95_hz / found_hz, speed.ci95_hz / speed.value_hz)
        read[CAGE_RATIO.name] = QuantityValue(
            value=cage_of(state, order, bearing.rolling_elements), ci95=width / bearing.rolling_elements
        )
    return read


def rows_of_predictions(
    content: Mapping[str, Any] | None, registered: Iterable[RegisteredRecording], bearing: Bearing
) -> tuple[Comparison, ...]:
    """Stored predictions against those of the `registered` recordings that they are of.

    `content` is that of the stored result, None where there is none. A record that cannot be analysed has no rows: the
    validation matrix lists it with the reason. Rows are `blind` where the project has never
    opened the record (`unopened`) and the predictions are those that were hashed, `withheld` otherwise.
    """
    if content is None:
        return ()
    unchanged = digest(content["predictions"]) == content["predictions_sha256"]
    of_rig = rig_recordings(tuple(registered))
    return tuple(row for one in content["predictions"] for row in _rows(one, of_rig, bearing, unchanged))


def _rows(
    prediction: Mapping[str, Any], registered: Sequence[RegisteredRecording], bearing: Bearing, unchanged: bool
) -> Iterator[Comparison]:
    state = Fault(prediction["state"])
    entry = _longest(entry for entry in registered if entry.state is state and _is_of(prediction, entry))
    if entry is None:
        return
    healthy = _longest(one for one in registered if one.state is Fault.HEALTHY and _is_of(prediction, one))
    try:
        record = load_entry(entry)
        rig = values_of_record(record, None if healthy is None else load_entry(healthy), state, bearing)
    except SrbvalError:
        return
    model = {name: QuantityValue(value=value) for name, value in prediction["values"].items()}
    used_for = "blind" if unchanged and unopened(entry) else "withheld"
    yield from rows(rig, model, prediction["parts"], record=record.name, fault=state, used_for=used_for)


def _is_of(prediction: Mapping[str, Any], entry: RegisteredRecording) -> bool:
    wanted = (prediction["nominal_rpm"], prediction["radial_kn"], prediction["axial_kn"])
    return (entry.nominal_rpm, entry.radial_kn, entry.axial_kn or 0.0) == wanted


def _longest(entries: Iterable[RegisteredRecording]) -> RegisteredRecording | None:
    return max(entries, key=lambda entry: entry.seconds or 0.0, default=None)
