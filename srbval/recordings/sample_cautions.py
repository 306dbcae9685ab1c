"""Cautions that follow from the samples of a measured channel: clipped, or held instead of measured."""

import math

import numpy as np
from numpy.typing import NDArray

from srbval.arrays import FloatArray
from srbval.recordings.raw import blocks_of

MIN_CLIPPED_IN_ROW, MIN_CLIPPED_TOTAL = 3, 10  # equal samples at an extreme, more than a vibration has there
# As many times more samples at the extreme as next to it, within this share of the range or at the next value: a
# coarsely digitised sine has 2.4; one that is sampled evenly at its peaks has none next to them.
PILED_UP, NEAR = 3, 0.01
SHORTEST_HOLD = 8  # samples; the recordings known here repeat a value three times at most
COARSE, LONG_HOLD = 2.5, 1000  # digital steps of a usual change from sample to sample; samples
MAX_CHANCE_HOLDS = 1e-3  # holds of this length expected by chance in the record
FULL_SCALES = {12: 2, 14: 2, 16: 1, 24: 1}  # bits of a converter; more samples at both extremes are no coincidence
CODE_ROUNDING = 0.01  # of a digital step


def sample_cautions(samples: FloatArray) -> tuple[str, ...]:
    """Clipped and held samples, with their counts; none for a constant signal, which the analysis refuses.

    A long signal is looked at in blocks; the first block with a caution of each kind stands for all.
    """
    blocks = [(first, _block_cautions(block, first, samples.size)) for first, block in blocks_of(samples)]
    if len(blocks) == 1:
        return blocks[0][1]
    kinds: dict[str, list[str]] = {}
    for first, said in blocks:
        for one in said[:1]:
            kinds.setdefault(one.split(":")[0], []).append(f"{one}, in the block from sample {first} on")
    return tuple(f"{every[0]}; {len(every)} of {len(blocks)} blocks have such samples" for every in kinds.values())


def _block_cautions(samples: FloatArray, begin: int, total: int) -> tuple[str, ...]:
    """Cautions of a block of a signal of `total` samples, which begins with sample `begin`."""
    if samples.size < 2 or samples.min() == samples.max():
        return ()
    starts = np.concatenate(([0], np.flatnonzero(samples[1:] != samples[:-1]) + 1))
    lengths, values = np.diff(starts, append=samples.size), samples[starts]
    said, clipped = [], np.zeros(values.size, dtype=bool)
    for extreme in (values.max(), values.min()):
        off = np.abs(values - extreme)
        at = off == 0
        near, following = ~at & (off <= NEAR * off.max()), off == off[~at].min()
        count, longest, bits = int(lengths[at].sum()), lengths[at].max(), _full_scale(samples, extreme)
        piled_up = count >= PILED_UP * lengths[near | following].sum()
        if bits or (piled_up and (longest >= MIN_CLIPPED_IN_ROW or (count >= MIN_CLIPPED_TOTAL and near.any()))):
            why = f", the limit of {bits} bits" if bits else ""
            said.append(f"clipped: {_share(count, samples)} at {extreme:.6g}{why}, up to {longest} in a row")
            clipped |= at
    held = ~clipped & (lengths >= _longest_by_chance(lengths, values, total))
    if held.any():
        first = int(np.argmax(lengths * held))
        said.append(
            f"held, not measured: {_share(int(lengths[held].sum()), samples)} in {held.sum()} run(s) of equal samples, "
            f"the longest {lengths[first]} times {values[first]:.6g} from sample {begin + starts[first]} on"
        )
    return tuple(said)


def _share(count: int, samples: FloatArray) -> str:
    return f"{count} of {samples.size} samples ({100 * count / samples.size:.2g} %)"


def _longest_by_chance(lengths: NDArray[np.intp], values: FloatArray, total: int) -> float:
    """Length from which a run of equal samples is no coincidence in a record of `total` samples.

    Chance produces fewer than `MAX_CHANCE_HOLDS` such runs in the record. The length is greater if the digital step is
    coarse compared with the changes between samples.
    """
    again, steps = float(np.mean(lengths > 1)), np.abs(np.diff(values))
    if again >= 1:
        return math.inf
    by_chance = math.log(total / MAX_CHANCE_HOLDS) / -math.log(again) if again else 0.0
    return max(LONG_HOLD if np.median(steps) < COARSE * steps.min() else SHORTEST_HOLD, by_chance + 1)


def _full_scale(samples: FloatArray, extreme: float) -> int | None:
    """Bits of the converter whose limit `extreme` is; its digital step is 1 or the smallest value but 0."""
    smallest = float(np.abs(samples[samples != 0]).min())
    for step in (1.0, smallest):
        code = extreme / step if step > np.abs(samples).max() / 2**32 else 0.0
        for bits, least in FULL_SCALES.items():
            half = 2 ** (bits - 1)
            limits = (half - 1, -half, 1 - half, 2 * half - 1 if samples.min() >= 0 else half - 1)
            if min(abs(code - limit) for limit in limits) < CODE_ROUNDING:
                codes, ends = samples / step, (samples == samples.max()) | (samples == samples.min())
                if ends.sum() > least and np.abs(codes - np.round(codes)).max() < CODE_ROUNDING:
                    return bits
    return None
