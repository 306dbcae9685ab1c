"""Groups of lines a known spacing apart, wherever they stand within it, and how strong groups are that mean nothing.

A defect on a rolling element strikes while the element passes the load zone, once per revolution of the cage. Its line
is therefore a group of lines the cage frequency apart, with its centre at the rate of strikes in the load zone. Outside
of it the element may turn more slowly, so that the strikes of one passage are shifted in phase against those of the
one before. That moves all lines of the group, by up to half the spacing, and leaves the centre where it is: pulses that
recur after T with their phase advanced by phi have lines at (n + phi / 2 pi) / T, under the spectrum of one passage.
That is the geometric series of the passages' spectra, exp(i k (phi - 2 pi f T)) summed over k: derived here, not quoted.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from srbval.arrays import FloatArray
from srbval.signal.comb_spectrum import MASKED, scores
from srbval.signal.periodogram import Periodogram

# Lines to either side of the middle one, and harmonics of the group.
SIDE_LINES, HARMONICS = 2, 2
# Spacings of other groups, as shares of the group's own: only the middle lines coincide with any of its lines.
OTHER_SPACINGS = 0.83, 1.17
_OVERSAMPLING = 4  # grid points per bin


@dataclass(frozen=True, kw_only=True)
class Group:
    """The strongest group about a centre: its `evidence`, the line nearest to the centre and the spacing [Hz]."""

    evidence: float
    found_hz: float
    spacing_hz: float


def strongest_group(
    record: Periodogram, centre_hz: float, spacing_hz: float, relative: float
) -> tuple[Group | None, FloatArray]:
    """The strongest group about `centre_hz`, and the evidence of others [k], about other centres or of other spacing.

    The evidence is the sum of log(1 + power over local noise) of a line within half a spacing of the centre and of
    `SIDE_LINES` to either side of it, and of as many about twice the centre; the highest of all places and of all
    spacings within `relative` of `spacing_hz`. Other groups have their centres within an octave, no nearer than a
    group is wide. None, and no others, where a group reaches below zero or beyond the record's limit.
    """
    half_width_hz = (SIDE_LINES + 1) * spacing_hz
    if centre_hz <= half_width_hz or HARMONICS * centre_hz + half_width_hz > record.limit_hz:
        return None, np.empty(0)
    step_hz = record.bin_hz / _OVERSAMPLING
    score = scores(record, np.arange(0.0, record.limit_hz, step_hz))
    lowest_hz = max(centre_hz / 2, half_width_hz)
    centres = np.arange(lowest_hz, min(2 * centre_hz, record.limit_hz / HARMONICS), spacing_hz)
    apart = np.abs(centres - centre_hz) > SIDE_LINES * spacing_hz
    own, *others = _about(score, step_hz, np.concatenate(([centre_hz], centres[apart])), spacing_hz, relative)
    for share in OTHER_SPACINGS:
        others += _about(score, step_hz, centres, share * spacing_hz, relative)
    return own, np.array([group.evidence for group in others])


def _about(
    score: FloatArray, step_hz: float, centres_hz: FloatArray, spacing_hz: float, relative: float
) -> list[Group]:
    """The strongest group about each centre [c]; `score` [n] is of multiples of `step_hz`."""
    finest = step_hz / (SIDE_LINES + 1)  # the outermost lines are then off by a third of a step at most
    half = math.ceil(relative * spacing_hz / finest)
    best = [Group(evidence=-math.inf, found_hz=math.nan, spacing_hz=spacing_hz)] * centres_hz.size
    for spacing in spacing_hz + finest * np.arange(-half, half + 1):
        summed = _with_neighbours(score, spacing / step_hz)
        line = np.arange(-spacing / 2, spacing / 2, step_hz)  # from the centre
        total = np.zeros((centres_hz.size, line.size))
        for harmonic in range(1, HARMONICS + 1):
            nearest = harmonic * line - spacing * np.rint(harmonic * line / spacing)
            at = np.rint((harmonic * centres_hz[:, None] + nearest) / step_hz).astype(np.int64)
            total += summed[np.minimum(at, summed.size - 1)]
        top = np.argmax(total, axis=1)
        for number, highest in enumerate(total[np.arange(top.size), top]):
            if highest > best[number].evidence:
                found_hz = float(centres_hz[number] + line[top[number]])
                best[number] = Group(evidence=float(highest), found_hz=found_hz, spacing_hz=float(spacing))
    return best


def _with_neighbours(score: FloatArray, spacing: float) -> FloatArray:
    """Sum of each score and of those `spacing`, a number of steps, and its multiples to either side, [n]."""
    ends = round(SIDE_LINES * spacing)
    padded = np.pad(score, ends, constant_values=MASKED)
    shifts = [ends + round(m * spacing) for m in range(-SIDE_LINES, SIDE_LINES + 1)]
    return np.asarray(np.sum([padded[at : at + score.size] for at in shifts], axis=0))
