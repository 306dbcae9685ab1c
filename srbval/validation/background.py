"""A measured background under a simulated run: for what hangs on it, and for nothing else."""

from dataclasses import replace

from srbval.errors import ConfigurationError
from srbval.recordings import Origin, Recording
from srbval.recordings.datasets.srbval_files import SENSOR
from srbval.signal.surrogate import phase_randomised
from srbval.validation.baseline import SAME_SHARE
from srbval.validation.pipeline import one_signal


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
    return replace(
        run, channels={SENSOR: both}, channel=SENSOR, axes=None, name=f"{run.name}, on a measured background",
        notes=(*run.notes, note), cautions=cautions,
    )  # fmt: skip
