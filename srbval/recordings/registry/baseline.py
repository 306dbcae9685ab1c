"""The healthy record that a faulted one is to be held against."""

from __future__ import annotations

import os
from pathlib import Path

from srbval.bearing import Fault
from srbval.recordings.datasets.description import known_datasets
from srbval.recordings.recording import Recording
from srbval.recordings.registry.entry import RegisteredRecording, Status
from srbval.recordings.registry.verbs import RIG_DATASETS, listing

N_PER_KN = 1e3


def healthy_baseline(
    recording: Recording, registered: tuple[RegisteredRecording, ...] | None = None
) -> RegisteredRecording | None:
    """The registered healthy record of the same rig, sensor, nominal speed, load and sampling rate, or None.

    `registered` saves looking at the register again. Of several the longest. A record without a data set or
    without a nominal speed has none: nothing says that another one is its like. Never the record itself.
    """
    if recording.dataset is None or recording.nominal_rpm is None or recording.file is None:
        return None
    candidates = listing().recordings if registered is None else registered
    fitting = [entry for entry in candidates if _alike(entry, recording)]
    return max(fitting, key=lambda entry: entry.seconds or 0.0, default=None)


def _alike(entry: RegisteredRecording, recording: Recording) -> bool:
    here = os.path.abspath(recording.file or "")
    return (
        entry.status is Status.OK
        and entry.state is Fault.HEALTHY
        and entry.file != here
        and entry.sha256 != recording.sha256
        and _rig(entry.dataset, entry.file) == _rig(recording.dataset, here)
        and (entry.channel, entry.fs_hz) == (recording.channel, recording.fs_hz)
        and entry.nominal_rpm == recording.nominal_rpm
        and (_n(entry.radial_kn), _n(entry.axial_kn)) == (recording.radial_n, recording.axial_n)
    )


def _rig(dataset: str | None, file: str) -> tuple[str | None, str]:
    """What makes two records come from one machine: the set, and its folder where a set holds several rigs."""
    if dataset in RIG_DATASETS:
        return RIG_DATASETS[0], ""
    apart = any(d.name == dataset and d.one_rig_a_folder for d in known_datasets())
    return dataset, str(Path(file).parent) if apart else ""


def _n(load_kn: float | None) -> float | None:
    return None if load_kn is None else load_kn * N_PER_KN
