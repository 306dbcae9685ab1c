"""Simulated and measured sides of a case: loading, reading and pairing their signals."""

import dataclasses
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault
from srbval.comparison.compared_quantities import read_quantities
from srbval.comparison.comparison import QuantityValue
from srbval.comparison.counterpart import AnalysedRun, run_counterpart
from srbval.errors import ConfigurationError, DataError
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analysis_once
from srbval.reading.pipeline import RIG_BEARING
from srbval.recordings import Origin, Recording, load_recording
from srbval.recordings.load import read_file
from srbval.recordings.manifest import RegisteredRecording
from srbval.recordings.registry import is_unopened, listing, recording_of, registered_settings, rig_recordings
from srbval.recordings.settings import BEARING_QUESTION
from srbval.validation.case import CasePair, Source, ValidationCase, files_of_source


@dataclass(frozen=True, kw_only=True, eq=False)
class SideReading:
    """Results from the signals of one side, simulated or measured.

    `model` is the run of a simulated scene, None for files. `scene` is the scene's name, None for files, for a scene
    in which another model replaced the scene's own, and for another bearing than the rig's.
    """

    analyses: tuple[Analysis, ...]
    values: tuple[Mapping[str, QuantityValue], ...]
    scene: str | None = None
    model: AnalysedRun | None = None

    @property
    def shaft_hz(self) -> float:
        """Mean shaft speed of all signals [Hz]."""
        return sum(one.speed.value_hz for one in self.analyses) / len(self.analyses)

    @property
    def files(self) -> tuple[str, ...]:
        """File names of the signals, or name of the run."""
        return tuple(one.recording.file or one.recording.name for one in self.analyses)


def load_files(source: Source, folder: Path, side: str) -> tuple[Recording, ...]:
    """Load the recordings of a side; `ConfigurationError` if a measured file states that it is simulated."""
    measured = side == "measured"
    given: list[Any] = [one for one in source.file or () if isinstance(one, Recording)]
    found = given if measured else [dataclasses.replace(one, origin=Origin.SIMULATED) for one in given]
    settings = source.settings if measured else dataclasses.replace(source.settings, origin=Origin.SIMULATED)
    for path in files_of_source(source, folder, side):
        try:
            found.append(recording_of(path, settings) if measured else load_recording(path, settings))
        except DataError as error:
            if not error.questions:
                raise
            asked = "; ".join(str(question) for question in error.questions if question != BEARING_QUESTION)
            raise DataError(
                f"{side} side: information about {error.subject} is missing: {asked}. Put it into [{side}] of the case "
                f"(channel = 'NAME' for --channel), or use `srbval validate CASE.toml --set {side}.channel=NAME`."
            ) from None
    for recording in found if measured else ():
        if recording.origin is not Origin.MEASURED:
            raise ConfigurationError(
                f"{recording.file or recording.name}: states that it is {recording.origin}, but is given as measured. "
                "Give it with --simulated, or name a measured file."
            )
    return tuple(found)


def read_files(recordings: tuple[Recording, ...], source: Source, bearing: Bearing, state: Fault) -> SideReading:
    """Analyse the signals of one side and read the compared quantities.

    The frequency band is chosen from the signal if `source` states `auto_band`, or if another program simulated a
    bearing other than the rig's and no band is stated for the file; otherwise the band is that of `analyse`.
    """
    analyses, values = list[Analysis](), list[dict[str, QuantityValue]]()
    for recording in recordings:
        other = recording.origin is Origin.SIMULATED and bearing.name != RIG_BEARING and recording.own_bearing is None
        chosen = source.auto_band or (other and recording.band_hz is None)
        analyses.append(analysis_once(recording, bearing, auto_band=bool(chosen)))
        ratio = recording.cage_ratio
        order = None if ratio is None else state.passing_order(bearing.rolling_elements, ratio)
        values.append(read_quantities(analyses[-1], state, order))
    return SideReading(analyses=tuple(analyses), values=tuple(values))


def run_scene(
    source: Source, case: ValidationCase, against: SideReading, state: Fault, *, progress: Progress = silent
) -> SideReading:
    """Simulate a scene at speed and load of the measured side `against`, with defect `state`; analyse the run."""
    base, (file, colon, function) = source.scene or "", (source.model or "").rpartition(":")
    found = run_counterpart(
        against.analyses[0],
        state,
        case.beside(base),
        source.band_hz,
        model=case.beside(file) + colon + case.beside(function),
        bearing_name=case.beside(case.bearing or DEFAULT_BEARING),
        progress=progress,
    )
    of_rig = not source.model and case.known_bearing.name == RIG_BEARING  # effects of inputs are known for it alone
    scene = base if of_rig else None
    return SideReading(analyses=(found.analysis,), values=(found.values,), scene=scene, model=found)


def stated_state(pair_state: Fault | None, recordings: tuple[Recording, ...]) -> Fault:
    """State of the bearing, from the pair or its recordings; `ConfigurationError` if unknown or contradictory."""
    stated = {one.state: Path(one.file or one.name).name for one in recordings if one.state is not None}
    state = pair_state or next(iter(stated), None)
    if state is None:
        names = ", ".join(Path(one.file or one.name).name for one in recordings)
        raise ConfigurationError(
            f'{names}: the bearing state is not known; give the pair state = "outer", "inner", "roller" or "healthy".'
        )
    for other, name in stated.items():
        if other is not state:
            raise ConfigurationError(
                f"{name} states the bearing state {other}, but its pair has the state {state}: change the state of the "
                "pair, or put another file into the pair."
            )
    return state


# Words of a file name that state what is damaged; shorter words occur in too many names.
STATE_WORDS = {
    Fault.OUTER: ("outer", "outerrace", "or", "bpfo"),
    Fault.INNER: ("inner", "innerrace", "ir", "bpfi"),
    Fault.ROLLER: ("roller", "ball", "rollingelement"),
    Fault.HEALTHY: ("healthy", "normal", "baseline", "nodefect"),
}
RIG = "torino"  # the name in a case for all registered records of the paper's rig
MAX_LOAD_DIFFERENCE = 0.02  # relative difference up to which two stated radial loads are the same


def state_in_name(name: str) -> Fault | None:
    """State of the bearing from the words of a file name; None if no word or contradictory words are found."""
    words = set(re.split(r"[^a-z]+", name.lower()))
    found = {state for state, known in STATE_WORDS.items() if words & set(known)}
    return found.pop() if len(found) == 1 else None


def describe_file(path: Path, source: Source, state: Fault | None) -> dict[str, Any]:
    """Describe a file: bearing state with its source, speed [rpm] and radial load [N] (NaN if unknown).

    `state` applies if neither file nor file name states one; without any state raises `ConfigurationError`.
    """
    reading = read_file(path, registered_settings(path, source.settings))
    states = {channel.state for channel in reading.channels.values()} - {None}
    known = {"the file": states.pop() if len(states) == 1 else None, "its name": state_in_name(path.stem)}
    state_from, found = next(((of, one) for of, one in {**known, "--state": state}.items() if one), ("", None))
    if found is None:
        raise ConfigurationError(
            f"{path}: neither the file nor its name states what is damaged; give --state outer, inner, roller or "
            "healthy, or a case with a state for each pair."
        )
    mean_rpm = math.nan if reading.speed is None else 60 * reading.speed.value_hz
    rpm = mean_rpm if reading.nominal_rpm is None else reading.nominal_rpm
    return {"path": str(path), "state": found.value, "state_from": state_from, "rpm": rpm, "radial_n": reading.radial_n}


def pair_files(
    simulated: Sequence[str], measured: Sequence[str], settings: Mapping[str, Source], state: Fault | None = None
) -> list[dict[str, Any]]:
    """Pair simulated with measured files of the same state and load at the nearest speed; returns tables of `[[pair]]`.

    Files of one side with the same state, speed and load are repeats. `state` applies to files without a state. Raises
    `ConfigurationError` for a file without a state or a partner.
    """
    groups = {}
    for side, names in (("simulated", simulated), ("measured", measured)):
        paths = files_of_source(dataclasses.replace(settings[side], file=tuple(names)), Path(), side)
        files = pd.DataFrame([describe_file(path, settings[side], state) for path in paths]).astype({"radial_n": float})
        grouped = files.groupby(["state", "rpm", "radial_n"], dropna=False, sort=False, as_index=False)
        groups[side] = grouped.agg(path=("path", list), state_from=("state_from", "first"))
    theirs, pairs = groups["measured"], []
    for own in groups["simulated"].to_dict("records"):
        apart = (theirs["radial_n"] - own["radial_n"]).abs()
        fits = theirs[(theirs["state"] == own["state"]) & ~(apart > MAX_LOAD_DIFFERENCE * abs(own["radial_n"]))]
        if fits.empty:
            raise ConfigurationError(
                f"{Path(own['path'][0]).name}: no measured file has the state {Fault(own['state']).label} and the same "
                f"load; measured states: {', '.join(sorted(set(theirs['state'])))}. Leave the file out, or state the "
                "pairs in a case (`srbval validate --write-case FILE` shows its form)."
            )
        other = fits.loc[(fits["rpm"] - own["rpm"]).abs().fillna(math.inf).idxmin()]
        how = f"state by {own['state_from']} (simulated) and {other['state_from']} (measured), "
        how += "nearest speed and same radial load as far as both are known"
        pairs.append({"state": own["state"], "simulated": own["path"], "measured": other["path"], "how": how})
    return pairs


def registered_pairs(pair: CasePair) -> Iterator[CasePair]:
    """Split a pair whose measured side is all registered records into pairs of one speed, load and state each.

    Other pairs are returned unchanged. If several records have the same speed, load and state, the longest is used. The
    healthy record of each speed and load comes first and gets no simulated side. A record that was never opened before
    is marked ``blind``.
    """
    source = pair.measured
    if source is None or source.registered is None:
        yield pair
        return
    if source.registered != RIG or source.file:
        raise ConfigurationError(
            f"registered = {source.registered!r}: the only possible value is {RIG!r}, and the same side must not have "
            "the key `file`."
        )
    chosen: dict[tuple[Any, ...], RegisteredRecording] = {}
    for entry in sorted(rig_recordings(listing().recordings), key=lambda one: -(one.seconds or 0)):
        load = entry.radial_kn, entry.axial_kn or 0.0
        point = (entry.nominal_rpm, *load, entry.state is not Fault.HEALTHY, entry.state)
        if None not in point and entry.seconds:
            chosen.setdefault(point, entry)
    for _, entry in sorted(chosen.items(), key=lambda one: one[0]):
        used_for = "blind" if is_unopened(entry) else pair.used_for
        measured = dataclasses.replace(source, registered=None, file=(entry.file,))
        own = None if entry.state is Fault.HEALTHY else pair.simulated
        yield dataclasses.replace(
            pair, simulated=own, state=entry.state, measured=measured, used_for=used_for, how="a registered record"
        )
