"""A record demodulated at given frequencies and summed in blocks: all that a local fit needs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from srbval.arrays import ComplexArray, FloatArray

# Blocks that a record is summed in. A line within a bin of its frequency loses less than 2e-4 of its power in them.
BLOCKS = 96


@dataclass(frozen=True, kw_only=True, eq=False)
class Phasors:
    """Sums over blocks of the record demodulated at `frequency_hz` [c]: `sums`, [c, blocks].

    `time_s`, [blocks], are the blocks' middles counted from the record's middle, so that a line's frequency does not
    correlate with its amplitude and phase; `moments` [c, blocks] are the same sums with each sample times its
    distance in time from its block's middle; `seconds` is the whole record's duration.
    """

    frequency_hz: FloatArray
    sums: ComplexArray
    moments: ComplexArray
    time_s: FloatArray
    seconds: float

    @classmethod
    def of(cls, samples: FloatArray, fs_hz: float, frequency_hz: FloatArray, blocks: int = BLOCKS) -> Phasors:
        """Demodulate `samples` [n]; records shorter than `blocks` samples get one block per sample."""
        bounds = np.linspace(0, samples.size, min(blocks, samples.size) + 1).astype(int)
        middle = (samples.size - 1) / 2
        longest = int(np.diff(bounds).max())
        # Within a block the phase starts at its first sample: one short table of phases serves every block.
        # Real products: the record is real, and making it complex would cost more than everything else.
        within = np.arange(longest)
        angle = 2 * np.pi * np.outer(frequency_hz / fs_hz, within)
        cosine, sine = np.cos(angle), np.sin(angle)
        padded = np.zeros((bounds.size - 1, longest))
        for row, (first, end) in enumerate(pairwise(bounds)):
            padded[row, : end - first] = samples[first:end]
        real, imaginary, real_moment, imaginary_moment = np.split(
            np.concatenate([cosine, -sine, cosine * within, -sine * within]) @ padded.T, 4
        )
        start = np.exp(-2j * np.pi * np.outer(frequency_hz / fs_hz, bounds[:-1] - middle))
        sums = (real + 1j * imaginary) * start
        half = (np.diff(bounds) - 1) / 2
        return cls(
            frequency_hz=frequency_hz,
            sums=sums,
            moments=((real_moment + 1j * imaginary_moment) * start - half * sums) / fs_hz,
            time_s=(bounds[:-1] + half - middle) / fs_hz,
            seconds=samples.size / fs_hz,
        )

    def shifted(self, by_hz: FloatArray) -> Phasors:
        """The same demodulated at `by_hz` [c] higher frequencies; for shifts well within a block's bin."""
        rotation = np.exp(-2j * np.pi * by_hz[:, None] * self.time_s)
        turned = {"sums": self.sums * rotation, "moments": self.moments * rotation}
        return replace(self, frequency_hz=self.frequency_hz + by_hz, **turned)

    def power(self) -> FloatArray:
        """Power of each line, |sum over the record|^2, [c]."""
        return np.abs(self.sums.sum(axis=1)) ** 2

    def in_blocks(self, blocks: int) -> ComplexArray:
        """The sums in fewer blocks, [c, blocks]; `blocks` should divide the present number."""
        bounds = np.linspace(0, self.sums.shape[1], blocks + 1).astype(int)[:-1]
        return np.add.reduceat(self.sums, bounds, axis=1)
