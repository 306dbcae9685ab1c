"""Cautions about measured samples that are clipped, or repeated instead of measured."""

import math

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.recordings.raw import blocks_of

MIN_CLIPPED_IN_ROW, MIN_CLIPPED_TOTAL = 3, 10  # equal samples at an extreme, more than a vibration has there
# Least ratio of the samples at the extreme to the samples next to it (within this share of the range, or at the next
# value). A coarsely digitised sine has a ratio of 2.4; a sine sampled only at its peaks has no samples next to them.
PILED_UP, NEAR = 3, 0.01
SHORTEST_HOLD = 8  # samples; known recordings repeat a value three times at most
COARSE, LONG_HOLD = 2.5, 1000  # usual change [digital steps] below which only long holds count [samples]
MAX_CHANCE_HOLDS = 1e-3  # expected number of such runs in a record


def sample_cautions(samples: FloatArray) -> tuple[str, ...]:
    """Cautions about clipped and repeated samples, with the number of these samples; none for a constant signal.

    A long signal is checked in blocks; the cautions describe the first affected block.
    """
    for first, block in blocks_of(samples):
        if said := _block_cautions(block, first, samples.size):
            where = f", in the block from sample {first} on" if block.size < samples.size else ""
            return tuple(one + where for one in said)
    return ()


def _block_cautions(samples: FloatArray, begin: int, total: int) -> tuple[str, ...]:
    """Cautions about one block of a signal of `total` samples; `begin` is the index of the block's first sample."""
    if samples.size < 2 or samples.min() == samples.max():
        return ()
    starts = np.concatenate(([0], np.flatnonzero(samples[1:] != samples[:-1]) + 1))
    lengths, values = np.diff(starts, append=samples.size), samples[starts]
    said, clipped = [], np.zeros(values.size, dtype=bool)
    for extreme in (values.max(), values.min()):
        off = np.abs(values - extreme)
        at = off == 0
        near, following = ~at & (off <= NEAR * off.max()), off == off[~at].min()
        count, longest = int(lengths[at].sum()), lengths[at].max()
        piled_up = count >= PILED_UP * lengths[near | following].sum()
        if piled_up and (longest >= MIN_CLIPPED_IN_ROW or (count >= MIN_CLIPPED_TOTAL and near.any())):
            said.append(f"clipped: {_share(count, samples)} at {extreme:.6g}, up to {longest} in a row")
            clipped |= at
    held = ~clipped & (lengths >= _shortest_unlikely_run(lengths, values, total))
    if held.any():
        first = int(np.argmax(lengths * held))
        said.append(
            f"repeated instead of measured: {_share(int(lengths[held].sum()), samples)} in {held.sum()} runs, "
            f"the longest {lengths[first]} times {values[first]:.6g} from sample {begin + starts[first]} on"
        )
    return tuple(said)


def _share(count: int, samples: FloatArray) -> str:
    return f"{count} of {samples.size} samples ({100 * count / samples.size:.2g} %)"


def _shortest_unlikely_run(lengths: NDArray[np.intp], values: FloatArray, total: int) -> float:
    """Least number of successive equal samples that is no coincidence, from `lengths` and `values` of all sequences."""
    again, steps = float(np.mean(lengths > 1)), np.abs(np.diff(values))
    if again >= 1:
        return math.inf
    by_chance = math.log(total / MAX_CHANCE_HOLDS) / -math.log(again) if again else 0.0
    return max(LONG_HOLD if np.median(steps) < COARSE * steps.min() else SHORTEST_HOLD, by_chance + 1)
