"""Joint fit of a line's frequency and the spacing of its sidebands to all harmonics and sidebands at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.signal.interval import NORMAL_95, frequency_error_hz
from srbval.signal.periodogram import Noise, Periodogram, Phasors
from srbval.signal.slip import track_slip

# A sideband this far above the noise is taken as present.
SIDEBAND_SNR = 12.0
# Sidebands are fitted with the first harmonics only: those of higher ones overlap with other lines.
SIDEBAND_HARMONICS = 3
_STEPS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class _Components:
    """Lines at ``number f + side s``, each [c], with their mean noise power in a bin and their power over it."""

    number: FloatArray
    side: FloatArray
    noise_power: FloatArray
    snr: FloatArray

    def selected(self, mask: NDArray[np.bool_]) -> _Components:
        return _Components(**{field: values[mask] for field, values in vars(self).items()})

    @property
    def directions(self) -> FloatArray:
        """How each moves with the line and, where there are sidebands, with their spacing, [c, 1 or 2]."""
        return np.column_stack((self.number, self.side)[: 2 if np.any(self.side != 0) else 1])


class JointFit(NamedTuple):
    """Frequency of the highest power, 95 % half widths in all and from noise; spacing, None without sidebands."""

    found_hz: float
    ci95_hz: float
    noise_ci95_hz: float
    sideband_hz: float | None = None
    sideband_ci95_hz: float | None = None


def fit(
    record: Periodogram, start_hz: float, noise: Sequence[Noise], sideband_hz: float, *, shortest_block_s: float | None
) -> JointFit:
    """Line and spacing of the highest power over noise, from a start within half a bin of the highest harmonic.

    `noise` is that about each harmonic. Where sidebands take part, both are free; `track_slip` then widens the interval
    by what slip may have done. A line too weak to be tracked, or with `shortest_block_s` None, keeps the Cramer-Rao
    interval.
    """
    components = _present(record, start_hz, noise, sideband_hz)
    phasors = Phasors.of(record.samples, record.fs_hz, components.number * start_hz + components.side * sideband_hz)
    shift = _maximise(phasors, components, components.directions)
    line_shift, side_shift = float(shift[0]), float(shift[1:].sum())
    line_hz = start_hz + line_shift
    shifted = phasors.shifted(components.number * line_shift + components.side * side_shift)
    components = replace(components, snr=shifted.power() / components.noise_power)
    sigma = _cramer_rao_hz(components, phasors.seconds)
    found, ci95 = line_hz, NORMAL_95 * sigma[0]
    if shortest_block_s is not None:
        slip = track_slip(
            shifted, components.number, components.noise_power, line_hz=found, shortest_block_s=shortest_block_s
        )
        if slip is not None:
            found, ci95 = found + slip[0], slip[1]
    if shift.size == 1:
        return JointFit(found, ci95, NORMAL_95 * sigma[0])
    spacing = _spacing_without_lines(record, line_hz, components, sideband_hz + side_shift)
    return JointFit(found, ci95, NORMAL_95 * sigma[0], spacing, NORMAL_95 * sigma[1])


def _present(record: Periodogram, line_hz: float, noise: Sequence[Noise], sideband_hz: float) -> _Components:
    """The unmasked harmonics of `line_hz`, and the sidebands on either side that stand out of the noise."""
    harmonics = len(noise)
    terms = [(h, 0) for h in range(1, harmonics + 1)]
    if sideband_hz > 0:
        pairs = [(h, k) for h in range(1, min(harmonics, SIDEBAND_HARMONICS) + 1) for k in (-1, 1)]
        terms += [(h, k) for h, k in pairs if h * line_hz + k * sideband_hz < record.limit_hz]
    number, side = np.array(terms, dtype=np.float64).T
    power = np.array([noise[h - 1].mean_power for h, _ in terms])
    at = number * line_hz + side * sideband_hz
    snr = np.where(record.masked(at), 0.0, record.power_at(at) / power)
    present = (side == 0) & (snr > 0) | (side != 0) & (snr > SIDEBAND_SNR)
    if not np.any(present):
        present[0] = True
    return _Components(number=number, side=side, noise_power=power, snr=snr).selected(present)


def _spacing_without_lines(record: Periodogram, line_hz: float, components: _Components, spacing_hz: float) -> float:
    """The spacing fitted again, with the lines themselves subtracted from the record.

    A line many times as strong as its sidebands lies only some tens of bins from them: without a window its side lobes
    would shift them by 3 r / (pi^2 d) bins, r times as strong in amplitude and d bins away.
    """
    harmonics = components.selected(components.side == 0)
    phase = 2 * np.pi * line_hz * (np.arange(record.samples.size) - (record.samples.size - 1) / 2) / record.fs_hz
    waves = np.column_stack([wave(number * phase) for number in harmonics.number for wave in (np.cos, np.sin)])
    rest = record.samples - waves @ np.linalg.solve(waves.T @ waves, waves.T @ record.samples)
    sidebands = components.selected(components.side != 0)
    phasors = Phasors.of(rest, record.fs_hz, sidebands.number * line_hz + sidebands.side * spacing_hz)
    sidebands = replace(sidebands, snr=phasors.power() / sidebands.noise_power)
    return spacing_hz + float(_maximise(phasors, sidebands, sidebands.side[:, None])[0])


def _maximise(phasors: Phasors, components: _Components, directions: FloatArray) -> FloatArray:
    """Newton steps on the weighted sum of powers: the shifts along `directions` [c, 1 or 2] in Hz, [1 or 2]."""
    # Components that rise little above the noise carry little information: weight by the line's share of the power.
    weight = np.maximum(components.snr - 1, 0.05) / np.maximum(components.snr, 1.05) / components.noise_power
    longest = 0.25 / (phasors.seconds * np.abs(directions).max(axis=0))
    shift = np.zeros(directions.shape[1])
    for _ in range(_STEPS):
        slope, curvature = _derivatives(phasors, directions @ shift)
        gradient = directions.T @ (weight * slope)
        hessian = directions.T @ ((weight * curvature)[:, None] * directions)
        # Newton's step to the maximum; where the sum is not yet concave, the longest allowed step uphill.
        concave = np.all(np.linalg.eigvalsh(hessian) < 0)
        step = -np.linalg.solve(hessian, gradient) if concave else np.sign(gradient) * longest
        shift = shift + np.clip(step, -longest, longest)
    return shift


def _derivatives(phasors: Phasors, by_hz: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slope and curvature of each component's power over its own frequency [1/Hz, 1/Hz2]."""
    shifted = phasors.shifted(by_hz)
    time = phasors.time_s
    total = shifted.sums.sum(axis=1)
    first = -2j * np.pi * (shifted.sums @ time + shifted.moments.sum(axis=1))
    second = (-2j * np.pi) ** 2 * (shifted.sums @ time**2 + 2 * (shifted.moments @ time))
    slope = 2 * (np.conj(total) * first).real
    curvature: FloatArray = 2 * (np.abs(first) ** 2 + (np.conj(total) * second).real)
    return slope, curvature


def _cramer_rao_hz(components: _Components, seconds: float) -> list[float]:
    """Standard errors of line and spacing from noise alone [Hz], 1 or 2."""
    directions = components.directions
    information = directions.T @ (np.maximum(components.snr - 1, 0)[:, None] * directions)
    information += np.eye(information.shape[0]) * 1e-12
    return [frequency_error_hz(1 / float(variance), seconds) for variance in np.diag(np.linalg.inv(information))]
