"""Single-sided amplitude spectra."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy.fft

from srbval.arrays import FloatArray

if TYPE_CHECKING:
    import pandas


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Spectrum:
    """Amplitude over frequency: `frequency_hz` and `amplitude`, both [m], from zero upwards.

    `resolution_hz` is one over the record's duration; the bins may stand closer than that.
    """

    frequency_hz: FloatArray
    amplitude: FloatArray
    resolution_hz: float

    def to_frame(self) -> pandas.DataFrame:
        """A pandas table of `frequency_hz` and `amplitude`."""
        import pandas

        return pandas.DataFrame({"frequency_hz": self.frequency_hz, "amplitude": self.amplitude})

    def __repr__(self) -> str:
        count, last = self.frequency_hz.size, self.frequency_hz[-1] if self.frequency_hz.size else 0.0
        return f"<Spectrum to {last:g} Hz, {count} bins, resolution {self.resolution_hz:.3g} Hz>"

    def up_to(self, limit_hz: float) -> Spectrum:
        """The part at or below `limit_hz` [Hz]."""
        below = self.frequency_hz <= limit_hz
        return Spectrum(
            frequency_hz=self.frequency_hz[below], amplitude=self.amplitude[below], resolution_hz=self.resolution_hz
        )


def amplitude_spectrum(samples: FloatArray, fs_hz: float) -> Spectrum:
    """Spectrum of `samples` [n] about its mean; a sine of amplitude a on a bin reads a.

    No window, so that the resolution is the record's own; padded to a fast length. For a carrier A modulated with
    depth m the line reads A m in the spectrum of the envelope and 2 A^2 m in that of the squared envelope.
    """
    length = scipy.fft.next_fast_len(samples.size, real=True)
    lines = np.abs(scipy.fft.rfft(samples - samples.mean(), n=length)) * (2 / samples.size)
    return Spectrum(
        frequency_hz=np.arange(lines.size, dtype=np.float64) * (fs_hz / length),
        amplitude=lines,
        resolution_hz=fs_hz / samples.size,
    )
