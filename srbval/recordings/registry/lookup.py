"""Registered recordings for a purpose: the rig's, one operating point, the healthy baseline; loading with settings."""

import os
from dataclasses import replace
from pathlib import Path

from srbval.bearing import Fault
from srbval.errors import DataError
from srbval.recordings.datasets.description import dataset, known_datasets
from srbval.recordings.load import load_recording
from srbval.recordings.reading import N_PER_KN, scaled
from srbval.recordings.recording import Origin, Recording
from srbval.recordings.registry.manifest import FileStatus, RegisteredRecording, read_manifest, without_copies
from srbval.recordings.registry.register import listing, shipped_recordings
from srbval.recordings.settings import RecordingSettings
from srbval.recordings.speed import RPM_PER_HZ

Registered = tuple[RegisteredRecording, ...]
RIG_DATASETS = ("torino-full", "torino-excerpts")  # the longer recordings first
RADIAL_KN = 124.8  # under which most of the rig's records were taken
SAME_SPEED = 0.05  # share by which the speeds of a record and its baseline may differ if no set point is known


def rig_recordings(
    registered: Registered | None = None, *, state: Fault | None = None, nominal_rpm: float | None = None
) -> Registered:
    """Usable recordings of the rig, full ones first, each content once; shipped ones if no own one is equal."""
    own = [r for r in (listing().recordings if registered is None else registered) if _usable_of_rig(r)]
    points = {r.operating_point for r in own}
    shipped = [r for r in shipped_recordings() if _usable_of_rig(r) and r.operating_point not in points]
    found = [r for r in (*own, *shipped) if state in (None, r.state) and nominal_rpm in (None, r.nominal_rpm)]
    return tuple(sorted(without_copies(found), key=lambda r: (RIG_DATASETS.index(r.dataset or ""), r.file)))


def _usable_of_rig(entry: RegisteredRecording) -> bool:
    return entry.dataset in RIG_DATASETS and entry.status is FileStatus.OK


def unopened(entry: RegisteredRecording) -> bool:
    """True for a record of the rig with neither the content nor the operating point of an opened one (`used_for`)."""
    excerpts = dataset(RIG_DATASETS[-1])
    opened = {file.sha256 for file in excerpts.files if file.used_for}
    known = entry.sha256 in opened or entry.operating_point in excerpts.operating_points
    return _usable_of_rig(entry) and not known


def find_recording(*, state: Fault, nominal_rpm: float) -> RegisteredRecording | None:
    """The rig recording at one speed [rpm] under `RADIAL_KN` alone, or None; the longest if there are several."""
    found = rig_recordings(state=state, nominal_rpm=nominal_rpm)
    at_load = [r for r in found if (r.radial_kn, r.axial_kn) == (RADIAL_KN, 0.0)]
    return max(at_load, key=lambda r: r.seconds or 0.0, default=None)


def healthy_baseline(recording: Recording) -> RegisteredRecording | None:
    """The longest other healthy record of the same rig, sensor, nominal speed, load and sampling rate, or None.

    Without a data set the bearing must be the same and the mean speeds must agree to `SAME_SPEED`; a record without a
    speed has no baseline.
    """
    mean_rpm = None if recording.speed is None else recording.speed.value_hz * RPM_PER_HZ
    rpm = mean_rpm if recording.dataset is None else recording.nominal_rpm
    if recording.file is None or rpm is None:
        return None
    rig = rig_of(recording.dataset, os.path.abspath(recording.file))
    conditions = recording.channel, recording.fs_hz, recording.radial_n, recording.axial_n

    def comparable(entry: RegisteredRecording) -> bool:
        loads_n = scaled(entry.radial_kn, N_PER_KN), scaled(entry.axial_kn, N_PER_KN)
        if (entry.channel, entry.fs_hz, *loads_n) != conditions or rig_of(entry.dataset, entry.file) != rig:
            return False
        if recording.dataset is not None:
            return entry.nominal_rpm == rpm
        return entry.bearing == recording.bearing and abs((entry.rpm or 0.0) / rpm - 1) <= SAME_SPEED

    usable = (r for r in (*listing().recordings, *shipped_recordings()) if r.status is FileStatus.OK)
    usable = (r for r in usable if (r.origin is Origin.SIMULATED) == (recording.origin is Origin.SIMULATED))
    healthy = (r for r in usable if r.state is Fault.HEALTHY and r.sha256 != recording.sha256 and comparable(r))
    return max(healthy, key=lambda entry: entry.seconds or 0.0, default=None)


def rig_of(dataset: str | None, file: str) -> tuple[str | None, str]:
    """Identity of the machine of a record: the data set; its folder without one, or if a set contains several."""
    if dataset in RIG_DATASETS:
        return RIG_DATASETS[0], ""
    per_folder = dataset is None or any(d.name == dataset and d.one_rig_a_folder for d in known_datasets())
    return dataset, str(Path(file).parent) if per_folder else ""


def load_entry(entry: RegisteredRecording) -> Recording:
    """A registered recording, read with its settings; raises what `load_recording` raises."""
    return load_recording(entry.file, entry.settings)


def load_registered(
    path: str | Path, settings: RecordingSettings | None = None, band_hz: tuple[float, float] | None = None
) -> Recording:
    """`load_recording` with `registered_settings`."""
    return load_recording(path, registered_settings(path, settings, band_hz))


def registered_settings(
    path: str | Path, settings: RecordingSettings | None = None, band_hz: tuple[float, float] | None = None
) -> RecordingSettings:
    """`settings`, and the register's for a file if these are not given and it can be read.

    A signal that is resampled is resampled for the band of its analysis, `band_hz`.
    """
    try:
        entry = read_manifest().get(os.path.abspath(path))
    except DataError:
        entry = None
    merged = (settings or RecordingSettings()).over((entry and entry.settings) or RecordingSettings())
    return replace(merged, band_hz=band_hz, auto_band=None) if band_hz and merged.resample_hz else merged
