"""The healthy record that a record is compared with, registered or given, and how it differs; or noise under a run."""

import dataclasses

from srbval.bearing import Fault
from srbval.diagnosis.baseline_comparison import Baseline
from srbval.errors import ConfigurationError
from srbval.reading.analyse import Analysis, analyse
from srbval.reading.pipeline import one_signal
from srbval.recordings import Origin, Recording, RecordingSettings
from srbval.recordings.datasets.srbval_files import SENSOR
from srbval.recordings.registry import healthy_baseline, load_registered
from srbval.signal import phase_randomised

# Speeds, and loads, that differ by no more than this share are one operating point: a motor's slip under load.
SAME_SHARE = 0.03
N_PER_KN = 1000.0


def registered_baseline(analysis: Analysis) -> Recording | None:
    """The registered healthy record of the same rig, speed and load, or None; raises what loading it raises."""
    entry = healthy_baseline(analysis.recording)
    if entry is None:
        return None
    return load_registered(entry.file, RecordingSettings(channel=analysis.recording.channel))


def load_healthy(path: str, settings: RecordingSettings) -> Recording:
    """A healthy record by its file, with the settings of the record that is compared with it.

    Its own speed, state and loads count; the `settings`' speed only where it states none. `ConfigurationError` where it
    is declared faulty.
    """
    kept = dataclasses.replace(settings, state=None, radial_kn=None, axial_kn=None)
    healthy = load_registered(path, dataclasses.replace(kept, rpm=None, rpm_tolerance_pct=None))
    if healthy.speed is None and settings.rpm is not None:
        healthy = load_registered(path, kept)
    if healthy.state not in (None, Fault.HEALTHY):
        raise ConfigurationError(
            f"{path}: declared {healthy.state.label}, so it is no healthy record; give one of a healthy bearing, or "
            "none."
        )
    return healthy


def baseline_of(analysis: Analysis, healthy: Recording) -> Baseline:
    """`healthy` in the band and with the filter of `analysis`; raises what `analyse` raises.

    `ConfigurationError` where it is the very record that `analysis` was made of.
    """
    recording, processed = analysis.recording, analysis.processed
    if healthy.sha256 is not None and healthy.sha256 == recording.sha256:
        raise ConfigurationError(f"{healthy.name}: the healthy record is the record itself; give another, or none.")
    found = analyse(healthy, bearing=analysis.bearing, band_hz=processed.band_hz, band_filter=processed.band_filter)
    return Baseline(
        analysis=found,
        conditions=tuple(_conditions(analysis, found)),
        remarks=tuple(_remarks(recording, healthy)),
    )


def on_background(run: Recording, healthy: Recording, *, seed: int = 0) -> Recording:
    """The run with the spectrum of a `healthy` record under it, whose phases are random.

    Depth of modulation, kurtosis and signal-to-noise ratio compare with a measured record's only so. An increment over
    a healthy record must never be taken of it: the background is that record. Raises `ConfigurationError` for what is
    not simulated or not measured, and where rate, unit or length do not fit.
    """
    if run.origin is not Origin.SIMULATED or healthy.origin is not Origin.MEASURED:
        raise ConfigurationError(
            f"a background under {run.name}: it takes a simulated run and a measured record; these are "
            f"{run.origin.value} and {healthy.origin.value}."
        )
    for what, ours, theirs in (("sampled at", run.fs_hz, healthy.fs_hz), ("in", run.unit, healthy.unit)):
        if ours != theirs:
            raise ConfigurationError(
                f"background {healthy.name}: {what} {theirs}, the run {what} {ours}; both must be alike."
            )
    if healthy.samples < run.samples:
        raise ConfigurationError(
            f"background {healthy.name}: {healthy.seconds:.4g} s; it must last as long as the run, "
            f"{run.seconds:.4g} s: simulate a shorter run (--seconds)."
        )
    note = f"measured background: spectrum of {healthy.name}, phases random (seed {seed}); no increment is to be taken"
    cautions = run.cautions
    if run.speed and healthy.speed and abs(healthy.speed.value_hz / run.speed.value_hz - 1) > SAME_SHARE:
        cautions += (f"background at {healthy.speed.value_hz:.4g} Hz of the shaft, run at {run.speed.value_hz:.4g} Hz",)
    both = one_signal(run) + phase_randomised(one_signal(healthy)[: run.samples], seed)
    return dataclasses.replace(
        run, channels={SENSOR: both}, channel=SENSOR, axes=None, name=f"{run.name}, on a measured background",
        notes=(*run.notes, note), cautions=cautions,
    )  # fmt: skip


def _conditions(ours: Analysis, theirs: Analysis) -> list[str]:
    """What of speed and load differs between two records, in words."""
    said = []
    if not _same(ours.speed.value_hz, theirs.speed.value_hz):
        said.append(f"{60 * theirs.speed.value_hz:.0f} rpm instead of {60 * ours.speed.value_hz:.0f} rpm")
    for kind in ("radial", "axial"):
        here, there = (getattr(a.recording, f"{kind}_n") for a in (ours, theirs))
        if here is not None and there is not None and not _same(here, there):
            said.append(f"{kind} load {there / N_PER_KN:.4g} kN instead of {here / N_PER_KN:.4g} kN")
    return said


def _remarks(ours: Recording, theirs: Recording) -> list[str]:
    said = []
    if None in (ours.radial_n, theirs.radial_n):
        said.append("the load is not stated for both records: it is taken to be the same")
    if ours.channel != theirs.channel:
        said.append(f"another channel, {theirs.channel} instead of {ours.channel}")
    if ours.fs_hz != theirs.fs_hz:
        said.append(f"sampled at {theirs.fs_hz:g} Hz instead of {ours.fs_hz:g} Hz; the same band was used")
    if ours.unit != "m/s2" or theirs.unit != "m/s2":
        said.append("not both in m/s2: lines are compared as shares of the mean, not as levels")
    if theirs.state is None:
        said.append("declared healthy by the user alone")
    return said


def _same(one: float, other: float) -> bool:
    return abs(one - other) <= SAME_SHARE * max(abs(one), abs(other))
