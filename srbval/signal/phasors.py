"""A record demodulated at given frequencies and summed in blocks: all that a local fit needs of it."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]

# Blocks a record is summed in. Their own width costs a line within a bin of its place less than 2e-4 of its power.
BLOCKS = 96


@dataclass(frozen=True, kw_only=True, eq=False)
class Phasors:
    """Sums over blocks of the record turned back at `frequency_hz` [c]: `sums`, [c, blocks].

    `time_s`, [blocks], are the blocks' middles counted from the record's middle, so that neither amplitude nor
    phase of a line pulls at its frequency; `moments` [c, blocks] are the same sums with each sample times its
    distance in time from its block's middle; `seconds` is the whole record's duration.
    """

    frequency_hz: FloatArray
    sums: ComplexArray
    moments: ComplexArray
    time_s: FloatArray
    seconds: float

    @classmethod
    def of(cls, samples: FloatArray, fs_hz: float, frequency_hz: FloatArray, blocks: int = BLOCKS) -> Phasors:
        """Demodulate `samples` [n]; records shorter than `blocks` samples get a block a sample."""
        bounds = np.linspace(0, samples.size, min(blocks, samples.size) + 1).astype(int)
        middle = (samples.size - 1) / 2
        longest = int(np.diff(bounds).max())
        # Within a block the turn starts from its first sample: one short table of turns serves every block.
        # Real products: the record is real, and to make it complex would cost more than all else.
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

    def moved(self, by_hz: FloatArray) -> Phasors:
        """The same turned back at `by_hz` [c] higher frequencies; for moves well within a block's bin."""
        turn = np.exp(-2j * np.pi * by_hz[:, None] * self.time_s)
        return Phasors(
            frequency_hz=self.frequency_hz + by_hz, sums=self.sums * turn, moments=self.moments * turn,
            time_s=self.time_s, seconds=self.seconds,
        )  # fmt: skip

    def of_components(self, kept: NDArray[np.bool_]) -> Phasors:
        """Those of the frequencies that are `kept`."""
        return dataclasses.replace(
            self, frequency_hz=self.frequency_hz[kept], sums=self.sums[kept], moments=self.moments[kept]
        )

    def power(self) -> FloatArray:
        """Power of each line, |sum over the record|^2, [c]."""
        return np.abs(self.sums.sum(axis=1)) ** 2

    def in_blocks(self, blocks: int) -> ComplexArray:
        """The sums in fewer blocks, [c, blocks]; `blocks` should divide the number there is."""
        bounds = np.linspace(0, self.sums.shape[1], blocks + 1).astype(int)[:-1]
        return np.add.reduceat(self.sums, bounds, axis=1)
