"""The one chain from a recording to its envelope spectrum, the same for measured and simulated records."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from srbval.errors import ConfigurationError
from srbval.recordings.recording import Origin, Recording
from srbval.signal import (
    Spectrum,
    amplitude_spectrum,
    bandpass,
    check_band,
    drop_ends,
    envelope,
    normalise,
    rotate_axes,
)

FloatArray = NDArray[np.float64]

# Giraudo et al. 2025 (Sensors 25, 2419), sect. 5: bands found best for the simulated and the rig's signals.
SIMULATED_BAND_HZ = (500.0, 1500.0)
RIG_BAND_HZ = (1400.0, 2800.0)
RIG_BEARING = "skf-22240"


@dataclass(frozen=True, kw_only=True, eq=False)
class Processed:
    """A record after the chain; every array is [n] at `fs_hz`, without the ends that the filter spoils.

    `samples` is the rotated, normalised signal (dimensionless), `filtered` the same band-passed,
    `envelope` the Hilbert modulus of that, `spectrum` the amplitude spectrum of the envelope.
    """

    samples: FloatArray
    filtered: FloatArray
    envelope: FloatArray
    spectrum: Spectrum
    fs_hz: float
    band_hz: tuple[float, float]


def process(
    recording: Recording, *, band_hz: tuple[float, float] | None = None, channel: str | None = None
) -> Processed:
    """Rotate (two axes only), normalise, band-pass, take the envelope, drop the ends, transform.

    Follows sect. 5 of the paper. `channel` picks one channel instead of the recording's own choice.
    Raises `ConfigurationError` for an unknown channel or band, `DataError` for a constant or short record.
    """
    band = choose_band(recording, band_hz)
    check_band(band, recording.fs_hz)
    samples = normalise(_one_signal(recording, channel))
    filtered = bandpass(samples, recording.fs_hz, band)
    kept = drop_ends(envelope(filtered), recording.fs_hz)
    return Processed(
        samples=drop_ends(samples, recording.fs_hz),
        filtered=drop_ends(filtered, recording.fs_hz),
        envelope=kept,
        spectrum=amplitude_spectrum(kept, recording.fs_hz),
        fs_hz=recording.fs_hz,
        band_hz=band,
    )


def choose_band(recording: Recording, band_hz: tuple[float, float] | None) -> tuple[float, float]:
    """The demodulation band: the caller's, the data set's, else the paper's for the model or its rig [Hz].

    No rule guesses one for an unknown machine: a band chosen on the record it then judges finds lines in
    noise. `ConfigurationError` asks for it instead.
    """
    declared = band_hz if band_hz is not None else recording.band_hz
    if declared is not None:
        return declared
    if recording.origin is Origin.SIMULATED:
        return SIMULATED_BAND_HZ
    if recording.bearing == RIG_BEARING:
        return RIG_BAND_HZ
    raise ConfigurationError(
        f"{recording.name}: neither the file nor its data set states a demodulation band; give --band LO HI "
        "[Hz], about a structural resonance that the fault would excite."
    )


def _one_signal(recording: Recording, channel: str | None) -> FloatArray:
    name = channel if channel is not None else recording.channel
    if name is not None:
        if name not in recording.channels:
            raise ConfigurationError(f"{recording.name}: no channel {name!r}; it has {', '.join(recording.channels)}.")
        return recording.channels[name]
    first, second = recording.axes or ("", "")
    return rotate_axes(recording.channels[first], recording.channels[second])
