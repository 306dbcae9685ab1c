"""Pairs from lists of files: each simulated file with the measured one of its state and load, at the nearest speed."""

import dataclasses
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from srbval.bearing import Fault
from srbval.errors import ConfigurationError
from srbval.recordings.load import read_file
from srbval.recordings.registry import (
    RegisteredRecording,
    listing,
    registered_settings,
    rig_recordings,
    unopened,
)
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


@dataclass(frozen=True, kw_only=True)
class FileFacts:
    """Facts of a file for pairing: state (and `state_from`, its source), speed [rpm] and radial load [N], if known."""

    path: Path
    state: Fault | None
    state_from: str
    rpm: float | None
    radial_n: float | None


def state_in_name(name: str) -> Fault | None:
    """The state that the words of a file's name state; None if there are none or they contradict each other."""
    words = set(re.split(r"[^a-z]+", name.lower()))
    found = {state for state, known in STATE_WORDS.items() if words & set(known)}
    return found.pop() if len(found) == 1 else None


def facts_of(path: Path, settings: Source) -> FileFacts:
    """State, speed and load of a file with the settings of its side and of the register."""
    reading = apply_settings(path, read_file(path), settings.settings.over(registered_settings(path)))
    states = {channel.state for channel in reading.channels.values()} - {None}
    own, named = (states.pop() if len(states) == 1 else None), state_in_name(path.stem)
    rpm = None if reading.speed is None else 60 * reading.speed.value_hz
    return FileFacts(
        path=path,
        state=own or named,
        state_from="the file" if own else "its name" if named else "",
        rpm=rpm if reading.nominal_rpm is None else reading.nominal_rpm,
        radial_n=reading.radial_n,
    )


def pair_files(
    simulated: Sequence[str], measured: Sequence[str], settings: Mapping[str, Source], state: Fault | None = None
) -> list[dict[str, Any]]:
    """Tables of `[[pair]]` for lists of files; files of one side with the same state, speed and load are repeats.

    A simulated group is paired with the measured group of its state whose load is the same or unknown and whose speed
    is nearest. `state` is taken for files that state none. Raises `ConfigurationError` for a file whose state is not
    known and for a group without a partner.
    """
    groups = {}
    for side, names in (("simulated", simulated), ("measured", measured)):
        source = settings[side]
        paths = files_of_source(dataclasses.replace(source, file=tuple(names)), Path(), side)
        groups[side] = _grouped([_with_state(facts_of(path, source), state, side) for path in paths])
    pairs = []
    for key, files in groups["simulated"].items():
        partner = _partner(key, list(groups["measured"]))
        if partner is None:
            have = ", ".join(sorted({one[0].label for one in groups["measured"]})) or "none"
            raise ConfigurationError(
                f"{files[0].path.name}: no measured file has the state {key[0].label} and the same load; measured are: "
                f"{have}. Leave the file out, or state the pairs in a case (--write-case FILE shows its form)."
            )
        others = groups["measured"][partner]
        pairs.append(
            {
                "state": key[0].value,
                "simulated": [os.fspath(one.path) for one in files],
                "measured": [os.fspath(one.path) for one in others],
                "how": _how(key, partner, files[0], others[0]),
            }
        )
    return pairs


Group = tuple[Fault, float | None, float | None]  # state, speed [rpm], radial load [N]


def _with_state(facts: FileFacts, state: Fault | None, side: str) -> FileFacts:
    if facts.state is not None:
        return facts
    if state is None:
        raise ConfigurationError(
            f"{facts.path}: neither the {side} file nor its name states what is damaged; give --state outer, inner, "
            "roller or healthy, or a case with a state for each pair."
        )
    return dataclasses.replace(facts, state=state, state_from="--state")


def _grouped(files: Sequence[FileFacts]) -> dict[Group, list[FileFacts]]:
    found: dict[Group, list[FileFacts]] = {}
    for one in files:
        assert one.state is not None, "files without a state are refused"
        found.setdefault((one.state, one.rpm, one.radial_n), []).append(one)
    return found


def _partner(key: Group, others: Sequence[Group]) -> Group | None:
    state, rpm, load = key

    def fits(other: Group) -> bool:
        known = load is not None and other[2] is not None
        return other[0] is state and (not known or abs((load or 0) - (other[2] or 0)) <= SAME_LOAD * abs(load or 1))

    def apart(other: Group) -> float:
        return abs((other[1] or 0) - rpm) if rpm is not None else -(other[1] or 0)

    return min((other for other in others if fits(other)), key=apart, default=None)


def _how(key: Group, other: Group, simulated: FileFacts, measured: FileFacts) -> str:
    """How a pair was found, in words."""
    state = f"state by {simulated.state_from} (simulated) and {measured.state_from} (measured)"
    speed = ", nearest speed" if key[1] is not None and other[1] is not None else ", speed of one side unknown"
    load = ", same radial load" if key[2] is not None and other[2] is not None else ", load not stated by both"
    return state + speed + load


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
    chosen: dict[OperatingPoint, RegisteredRecording] = {}
    for entry in rig_recordings(listing(or_none=True).recordings):
        point = operating_point(entry)
        if point is not None and (entry.seconds or 0) > (chosen[point].seconds or 0 if point in chosen else 0):
            chosen[point] = entry
    for point in sorted(
        chosen, key=lambda one: (one.nominal_rpm, *one[1:3], one.state is not Fault.HEALTHY, one.state)
    ):
        entry = chosen[point]
        used_for = "blind" if unopened(entry) else pair.used_for
        measured = dataclasses.replace(source, registered=None, file=(entry.file,))
        own = None if point.state is Fault.HEALTHY else pair.simulated
        yield dataclasses.replace(
            pair, simulated=own, state=point.state, measured=measured, used_for=used_for, how="a registered record"
        )


class OperatingPoint(NamedTuple):
    """An operating point of Table 5: state, loads [kN], nominal motor speed [rpm]."""

    state: Fault
    radial_kn: float
    axial_kn: float
    nominal_rpm: float


def operating_point(entry: RegisteredRecording) -> OperatingPoint | None:
    """The operating point of a record; None if one of state, load and speed is not known."""
    if entry.state is None or entry.radial_kn is None or entry.nominal_rpm is None:
        return None
    return OperatingPoint(entry.state, entry.radial_kn, entry.axial_kn or 0.0, entry.nominal_rpm)
