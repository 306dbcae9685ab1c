"""One side of a pair: its signals, from files or from a run of the bundled model, read through the one pipeline."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Bearing, Fault
from srbval.comparison.compared_quantities import COMPARED, RACE_LINE, values_of_model
from srbval.comparison.comparison import QuantityValue
from srbval.comparison.counterpart import AnalysedRun, run_counterpart
from srbval.diagnosis.records import band_is_declared
from srbval.errors import ConfigurationError, DataError
from srbval.progress import Progress, silent
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import RIG_BEARING
from srbval.recordings import Origin, Recording, load_recording
from srbval.recordings.load import LeftOpenError
from srbval.recordings.registry import load_registered
from srbval.recordings.settings import BEARING_QUESTION
from srbval.validation.case import Case, Source, files_of_source

QUANTITIES = (RACE_LINE, *COMPARED)  # compared of every pair


@dataclass(frozen=True, kw_only=True, eq=False)
class SideReading:
    """One side as read: an analysis of each of its signals, and the compared quantities of each by name.

    `scene` is the bundled scene that was run, `model` its run; both None for files.
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
        """Names of the files, or of the run."""
        return tuple(one.recording.file or one.recording.name for one in self.analyses)


def load_files(source: Source, folder: Path, side: str) -> tuple[Recording, ...]:
    """Recordings of one side, all of them of that side's origin.

    A measured file that states that it is simulated is a `ConfigurationError`: nothing simulated passes as measured.
    """
    found = []
    for path in files_of_source(source, folder, side):
        try:
            if side == "measured":
                recording = load_registered(path, source.settings)
            else:
                recording = load_recording(path, dataclasses.replace(source.settings, origin=Origin.SIMULATED))
        except LeftOpenError as error:
            asked = "; ".join(str(question) for question in error.questions if question != BEARING_QUESTION)
            raise DataError(
                f"{side} side, {error.subject} leaves open: {asked}. Put the key into [{side}] of the case, or give "
                f"--set {side}.KEY=VALUE, such as --set {side}.channel=NAME."
            ) from None
        if side == "measured" and recording.origin is not Origin.MEASURED:
            raise ConfigurationError(
                f"{path}: states that it is {recording.origin}, and is given as measured. Give it with --simulated, or "
                "name a measured file."
            )
        found.append(recording)
    return tuple(found)


def read_files(recordings: tuple[Recording, ...], source: Source, bearing: Bearing, state: Fault) -> SideReading:
    """Analyse each recording of a side, in the stated band, the paper's of its rig and model, or one chosen on it."""
    analyses, values = list[Analysis](), list[dict[str, QuantityValue]]()
    for recording in recordings:
        analysis = analyse(recording, bearing=bearing, choose_on_record=_has_no_band(recording, source, bearing))
        ratio = recording.cage_ratio
        order = None if ratio is None else state.passing_order(bearing.rolling_elements, ratio)
        analyses.append(analysis)
        values.append(values_of_model(analysis, state, order, QUANTITIES))
    return SideReading(analyses=tuple(analyses), values=tuple(values))


def _has_no_band(recording: Recording, source: Source, bearing: Bearing) -> bool:
    """True if a band is to be chosen on the record: nobody states one, and the paper's is of another bearing."""
    if source.auto_band or recording.band_hz is not None:
        return bool(source.auto_band)
    if recording.origin is Origin.SIMULATED and bearing.name != RIG_BEARING and recording.own_bearing is None:
        return True
    return not band_is_declared(recording, bearing)


def run_scene(
    source: Source, case: Case, against: SideReading, state: Fault, *, progress: Progress = silent
) -> SideReading:
    """Run a scene of the bundled model beside the measured side, with its defect, and read it (`run_counterpart`)."""
    base, (file, colon, function) = source.scene or "", (source.model or "").rpartition(":")
    found = run_counterpart(
        against.analyses[0],
        state,
        case.beside(base),
        source.band_hz,
        QUANTITIES,
        model=case.beside(file) + colon + case.beside(function),
        bearing_name=case.beside(case.bearing or DEFAULT_BEARING),
        progress=progress,
    )
    read: dict[str, Any] = {"analyses": (found.analysis,), "values": (found.values,)}
    scene = None if source.model else base  # what is known of the scene's inputs is known of its own model alone
    return SideReading(**read, scene=scene, model=found)


def stated_state(pair_state: Fault | None, recordings: tuple[Recording, ...]) -> Fault:
    """State of a pair: its own, or that of its recordings; `ConfigurationError` if it is not known or contradicted."""
    stated = {one.state: one for one in recordings if one.state is not None}
    names = ", ".join(Path(one.file or one.name).name for one in recordings)
    if pair_state is None and not stated:
        raise ConfigurationError(f'{names}: the state is not known; give state = "outer" (inner, roller, healthy).')
    state = pair_state if pair_state is not None else next(iter(stated))
    if others := [one for own, one in stated.items() if own is not state]:
        raise ConfigurationError(
            f"{Path(others[0].file or others[0].name).name} states the state {others[0].state}, its pair {state}: mend "
            "the pair's state, or pair the file with another."
        )
    return state
