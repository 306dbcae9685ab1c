"""Fit of a line's frequency and its sidebands' spacing to all their components at once."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from srbval.signal.cramer_rao import frequency_error_hz
from srbval.signal.interval import NORMAL_95
from srbval.signal.periodogram import Noise, Periodogram
from srbval.signal.phasors import Phasors
from srbval.signal.wander import follow

FloatArray = NDArray[np.float64]

# A sideband this far above the noise is taken to be there.
SHOWN_SNR = 12.0
# Sidebands belong to the first harmonics: those of higher ones meet the next line's.
SIDEBAND_HARMONICS = 3
_STEPS = 6


@dataclass(frozen=True, kw_only=True, eq=False)
class Components:
    """Lines at ``number f + side s``, each [c], with their mean noise power in a bin and what they rise above it."""

    number: FloatArray
    side: FloatArray
    noise_power: FloatArray
    snr: FloatArray

    @classmethod
    def of(
        cls, record: Periodogram, line_hz: float, harmonics: int, sideband_hz: float, noise: list[Noise]
    ) -> Components:
        """The unmasked harmonics of `line_hz`, and the sidebands that stand out on both sides of one."""
        places = [(h, 0) for h in range(1, harmonics + 1)]
        if sideband_hz > 0:
            pairs = [(h, k) for h in range(1, min(harmonics, SIDEBAND_HARMONICS) + 1) for k in (-1, 1)]
            places += [(h, k) for h, k in pairs if h * line_hz + k * sideband_hz < record.limit_hz]
        number, side = np.array(places, dtype=np.float64).T
        power = np.array([noise[h - 1].mean_power for h, _ in places])
        at = number * line_hz + side * sideband_hz
        snr = np.where(record.masked(at), 0.0, record.power_at(at) / power)
        shown = (side == 0) & (snr > 0) | (side != 0) & (snr > SHOWN_SNR)
        if not np.any(shown):
            shown[0] = True
        return cls(number=number, side=side, noise_power=power, snr=snr).where(shown)

    def where(self, kept: NDArray[np.bool_]) -> Components:
        """Those that are `kept`."""
        return Components(
            number=self.number[kept], side=self.side[kept], noise_power=self.noise_power[kept], snr=self.snr[kept]
        )

    @property
    def has_sides(self) -> bool:
        """Whether sidebands are among them, so that their spacing can be told."""
        return bool(np.any(self.side != 0))


@dataclass(frozen=True, kw_only=True)
class JointFit:
    """`found_hz`, the place of most power, with its 95 % half width; spacing None without sidebands."""

    found_hz: float
    ci95_hz: float
    noise_ci95_hz: float
    sideband_hz: float | None = None
    sideband_ci95_hz: float | None = None


def fit(
    record: Periodogram, start_hz: float, components: Components, sideband_hz: float, *, shortest_block_s: float | None
) -> JointFit:
    """Line and spacing that gather most power over noise, from a start within half a bin of the highest harmonic.

    Where sidebands take part, both are free; `follow` then widens the interval by what
    slip may have done. A line too weak to be followed, or with `shortest_block_s` None, keeps the Cramer-Rao interval.
    """
    phasors = Phasors.of(record.samples, record.fs_hz, components.number * start_hz + components.side * sideband_hz)
    shift = _climb(phasors, components, _directions(components))
    shift = np.concatenate((shift, np.zeros(2 - shift.size)))
    moved = phasors.moved(components.number * shift[0] + components.side * shift[1])
    components = replace(components, snr=moved.power() / components.noise_power)
    sigma = _cramer_rao_hz(components, phasors.seconds)
    found = start_hz + float(shift[0])
    ci95 = noise_ci = NORMAL_95 * sigma[0]
    if shortest_block_s is not None:
        course = follow(
            moved, components.number, components.noise_power, line_hz=found, shortest_block_s=shortest_block_s
        )
        if course is not None:
            found, ci95 = found + course.shift_hz, course.ci95_hz
    spacing = sideband_hz + float(shift[1]) if components.has_sides else None
    if spacing is not None:
        spacing = _without_lines(record, start_hz + float(shift[0]), components, spacing)
    return JointFit(
        found_hz=found, ci95_hz=ci95, noise_ci95_hz=noise_ci, sideband_hz=spacing,
        sideband_ci95_hz=None if spacing is None else NORMAL_95 * sigma[1],
    )  # fmt: skip


def _without_lines(record: Periodogram, line_hz: float, components: Components, spacing_hz: float) -> float:
    """The spacing once more, with the lines themselves taken out of the record.

    A line many times as strong as its sidebands lies only some tens of bins from them: without a window its side lobes
    would pull at theirs by 3 r / (pi^2 d) bins, r times as strong in amplitude and d bins away.
    """
    own = components.where(components.side == 0)
    turn = 2 * np.pi * line_hz * (np.arange(record.samples.size) - (record.samples.size - 1) / 2) / record.fs_hz
    waves = np.column_stack([wave(number * turn) for number in own.number for wave in (np.cos, np.sin)])
    rest = record.samples - waves @ np.linalg.solve(waves.T @ waves, waves.T @ record.samples)
    sides = components.where(components.side != 0)
    places = sides.number * line_hz + sides.side * spacing_hz
    phasors = Phasors.of(rest, record.fs_hz, places)
    sides = replace(sides, snr=phasors.power() / sides.noise_power)
    return spacing_hz + float(_climb(phasors, sides, sides.side[:, None])[0])


def _directions(components: Components) -> FloatArray:
    """How each component moves with the line and the spacing, [c, 1 or 2]."""
    columns = (components.number, components.side)[: 2 if components.has_sides else 1]
    return np.column_stack(columns)


def _climb(phasors: Phasors, components: Components, directions: FloatArray) -> FloatArray:
    """Newton steps on the weighed sum of powers: the shifts along `directions`, [c, 1 or 2] [Hz], [1 or 2]."""
    # What rises little above the noise tells little: weigh by the share of each power that is line.
    weight = np.maximum(components.snr - 1, 0.05) / np.maximum(components.snr, 1.05) / components.noise_power
    longest = 0.25 / (phasors.seconds * np.abs(directions).max(axis=0))
    shift = np.zeros(directions.shape[1])
    for _ in range(_STEPS):
        slope, curvature = _derivatives(phasors, directions @ shift)
        gradient = directions.T @ (weight * slope)
        hessian = directions.T @ ((weight * curvature)[:, None] * directions)
        shift = shift + np.clip(_step(gradient, hessian, longest), -longest, longest)
    return shift


def _step(gradient: FloatArray, hessian: FloatArray, longest: FloatArray) -> FloatArray:
    """Newton's step to the top; where the sum is not yet hollow downwards, as far uphill as is allowed."""
    if np.all(np.linalg.eigvalsh(hessian) < 0):
        return np.asarray(-np.linalg.solve(hessian, gradient), dtype=np.float64)
    return np.sign(gradient) * longest


def _derivatives(phasors: Phasors, by_hz: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Slope and curvature of each component's power over its own frequency [1/Hz, 1/Hz2]."""
    moved = phasors.moved(by_hz)
    time = phasors.time_s
    total = moved.sums.sum(axis=1)
    first = -2j * np.pi * (moved.sums @ time + moved.moments.sum(axis=1))
    second = (-2j * np.pi) ** 2 * (moved.sums @ time**2 + 2 * (moved.moments @ time))
    slope = 2 * (np.conj(total) * first).real
    curvature: FloatArray = 2 * (np.abs(first) ** 2 + (np.conj(total) * second).real)
    return slope, curvature


def _cramer_rao_hz(components: Components, seconds: float) -> list[float]:
    """Standard errors of line and spacing from noise alone [Hz], 1 or 2."""
    directions = _directions(components)
    information = directions.T @ (np.maximum(components.snr - 1, 0)[:, None] * directions)
    information += np.eye(information.shape[0]) * 1e-12
    return [frequency_error_hz(1 / float(variance), seconds) for variance in np.diag(np.linalg.inv(information))]
