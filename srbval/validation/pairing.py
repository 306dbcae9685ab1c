"""Pairs from lists of files: each simulated file with the measured one of its state and load, at the nearest speed."""

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.errors import ConfigurationError
from srbval.recordings.load import read_file
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import listing, registered_settings, rig_recordings, unopened
from srbval.recordings.settings import apply_settings
from srbval.validation.case import CasePair, Source, files_of_source

# Words of a file's name that state what is damaged; shorter ones occur in too many names.
STATE_WORDS = {
    Fault.OUTER: ("outer", "outerrace", "or", "bpfo"),
    Fault.INNER: ("inner", "innerrace", "ir", "bpfi"),
    Fault.ROLLER: ("roller", "ball", "rollingelement"),
    Fault.HEALTHY: ("healthy", "normal", "baseline", "nodefect"),
}
RIG = "torino"  # the name in a case for all registered records of the paper's rig
SAME_LOAD = 0.02  # relative difference up to which two stated radial loads are the same


def state_in_name(name: str) -> Fault | None:
    """The state that the words of a file's name state; None if there are none or they contradict each other."""
    words = set(re.split(r"[^a-z]+", name.lower()))
    found = {state for state, known in STATE_WORDS.items() if words & set(known)}
    return found.pop() if len(found) == 1 else None


def facts_of(path: Path, source: Source, state: Fault | None) -> dict[str, Any]:
    """State of a file and where it is from, speed [rpm] and radial load [N] (NaN if unknown), with its settings.

    `state` is taken if the file and its name state none; without one `ConfigurationError`.
    """
    reading = apply_settings(path, read_file(path), source.settings.over(registered_settings(path)))
    states = {channel.state for channel in reading.channels.values()} - {None}
    known = {"the file": states.pop() if len(states) == 1 else None, "its name": state_in_name(path.stem)}
    state_from, found = next(((of, one) for of, one in {**known, "--state": state}.items() if one), ("", None))
    if found is None:
        raise ConfigurationError(
            f"{path}: neither the file nor its name states what is damaged; give --state outer, inner, roller or "
            "healthy, or a case with a state for each pair."
        )
    rpm = None if reading.speed is None else 60 * reading.speed.value_hz
    speed = rpm if reading.nominal_rpm is None else reading.nominal_rpm
    numbers = {"rpm": math.nan if speed is None else speed, "radial_n": reading.radial_n}
    return {"path": str(path), "state": found.value, "state_from": state_from} | numbers


def pair_files(
    simulated: Sequence[str], measured: Sequence[str], settings: Mapping[str, Source], state: Fault | None = None
) -> list[dict[str, Any]]:
    """Tables of `[[pair]]` for lists of files; files of one side with the same state, speed and load are repeats.

    Simulated files are paired with the measured ones of their state whose load is the same or unknown and whose speed
    is nearest. `state` is taken for files that state none. Raises `ConfigurationError` for a file whose state is not
    known and for files without a partner.
    """
    import pandas as pd

    groups = {}
    for side, names in (("simulated", simulated), ("measured", measured)):
        paths = files_of_source(dataclasses.replace(settings[side], file=tuple(names)), Path(), side)
        files = pd.DataFrame([facts_of(path, settings[side], state) for path in paths]).astype({"radial_n": float})
        grouped = files.groupby(["state", "rpm", "radial_n"], dropna=False, sort=False, as_index=False)
        groups[side] = grouped.agg(path=("path", list), state_from=("state_from", "first"))
    theirs, pairs = groups["measured"], []
    for own in groups["simulated"].to_dict("records"):
        apart = (theirs["radial_n"] - own["radial_n"]).abs()
        fits = theirs[(theirs["state"] == own["state"]) & ~(apart > SAME_LOAD * abs(own["radial_n"]))]
        if fits.empty:
            raise ConfigurationError(
                f"{Path(own['path'][0]).name}: no measured file has the state {Fault(own['state']).label} and the same "
                f"load; measured are: {', '.join(sorted(set(theirs['state'])))}. Leave the file out, or state the "
                "pairs in a case (--write-case FILE shows its form)."
            )
        other = fits.loc[(fits["rpm"] - own["rpm"]).abs().fillna(math.inf).idxmin()]
        known = {name: not math.isnan(own[name]) and not math.isnan(other[name]) for name in ("rpm", "radial_n")}
        how = f"state by {own['state_from']} (simulated) and {other['state_from']} (measured)"
        how += ", nearest speed" if known["rpm"] else ", speed of one side unknown"
        how += ", same radial load" if known["radial_n"] else ", load not stated by both"
        pairs.append({"state": own["state"], "simulated": own["path"], "measured": other["path"], "how": how})
    return pairs


def registered_pairs(pair: CasePair) -> Iterator[CasePair]:
    """The pair itself, or of a pair with all registered records of a rig one for each operating point.

    Of several records of a point the longest is taken; the healthy record of a speed and load comes first, without a
    run, since nothing of it is compared. A record that was not known before is ``blind``.
    """
    source = pair.measured
    if source is None or source.registered is None:
        yield pair
        return
    if source.registered != RIG or source.file:
        raise ConfigurationError(f"registered = {source.registered!r}: must be {RIG!r}, without a file beside it.")
    chosen: dict[tuple[Any, ...], RegisteredRecording] = {}
    for entry in rig_recordings(listing(or_none=True).recordings):
        point = (
            entry.nominal_rpm,
            entry.radial_kn,
            entry.axial_kn or 0.0,
            entry.state is not Fault.HEALTHY,
            entry.state,
        )
        if None not in point and (entry.seconds or 0) > (chosen[point].seconds or 0 if point in chosen else 0):
            chosen[point] = entry
    for _, entry in sorted(chosen.items(), key=lambda one: one[0]):
        used_for = "blind" if unopened(entry) else pair.used_for
        measured = dataclasses.replace(source, registered=None, file=(entry.file,))
        own = None if entry.state is Fault.HEALTHY else pair.simulated
        yield dataclasses.replace(
            pair, simulated=own, state=entry.state, measured=measured, used_for=used_for, how="a registered record"
        )
