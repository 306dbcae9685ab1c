"""Points of a campaign: what each case changes in the base scene."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from srbval.campaign.settings import Axes, Campaign, Sampling
from srbval.errors import ConfigurationError
from srbval.storage.units import LONGEST_TEXT, NUMBER_AND_UNIT, shown

Point = dict[str, Any]  # by dotted key of a scene file
MOST_CASES = 2_000_000  # planned in memory, each with a file of its own
MOST_RANGES = 100  # a scene has fewer numbers


def points(campaign: Campaign) -> Iterator[Point]:
    """The points of all blocks multiplied, each with its repeats' seeds; the first block changes slowest."""
    cases = campaign.repeats * math.prod(points_in(block) for block in campaign.axes)
    if cases > MOST_CASES:
        raise ConfigurationError(f"{cases:.3g} cases; the limit is {MOST_CASES}: split the campaign.")
    blocks = [list(block_points(block, campaign.seed + number)) for number, block in enumerate(campaign.axes)]
    for parts in itertools.product(*blocks):
        point: Point = {}
        for part in parts:
            twice = sorted(set(point) & set(part))
            if twice:
                raise ConfigurationError(f"axes: {twice[0]!r} is set by two blocks of axes.")
            point |= part
        for repeat in range(campaign.repeats):
            seed = {} if "seed" in point else {"seed": campaign.seed + repeat}
            yield point | (seed if campaign.repeats > 1 or campaign.seed else {})


def points_in(block: Axes) -> int:
    """How many points a block has, as far as that can be told without making them."""
    lengths = [len(choices) for choices in flat(block.values).values() if isinstance(choices, list)]
    return math.prod(lengths) if block.kind is Sampling.GRID else len(block.cases) + block.samples + sum(lengths[:1])


def block_points(block: Axes, seed: int) -> Iterator[Point]:
    """The points of one block; `seed` is that of its random ones."""
    if block.kind is Sampling.LIST:
        for case in block.cases:
            yield flat(case)
        return
    if block.kind in (Sampling.GRID, Sampling.ZIP):
        values = flat(block.values)
        for key, choices in values.items():
            if not isinstance(choices, list) or not choices:
                raise ConfigurationError(f"axes.values.{key}: expected a list of choices, found {shown(choices)}.")
        if block.kind is Sampling.ZIP and len({len(v) for v in values.values()}) > 1:
            lengths = ", ".join(f"{k} {len(v)}" for k, v in values.items())
            raise ConfigurationError(f"axes of kind 'zip': all lists must be equally long; they have {lengths}.")
        combine = zip if block.kind is Sampling.ZIP else itertools.product
        for choice in combine(*values.values()):
            yield dict(zip(values, choice, strict=True))
        return
    yield from _space_filling(block, seed)


def flat(table: Mapping[str, Any], prefix: str = "") -> Point:
    """Nested tables as dotted keys."""
    found: Point = {}
    for key, value in table.items():
        inner = flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
        twice = [name for name in inner if name in found]
        if twice:
            raise ConfigurationError(f"{min(twice)!r} is given twice.")
        found |= inner
    return found


def nested(point: Point) -> dict[str, Any]:
    """Dotted keys as nested tables."""
    table: dict[str, Any] = {}
    for key, value in point.items():
        *outer, last = key.split(".")
        inner = table
        for name in outer:
            inner = inner.setdefault(name, {})
            if not isinstance(inner, dict):
                raise ConfigurationError(f"axes: {key!r} and {name!r} cannot both be set.")
        inner[last] = value
    return table


def _space_filling(block: Axes, seed: int) -> Iterator[Point]:
    """Points that fill the ranges: Latin hypercube, or scrambled Sobol (McKay et al. 1979; Sobol 1967, Owen 1998)."""
    from scipy.stats import qmc

    ranges = {key: _range(key, ends) for key, ends in flat(block.ranges).items()}
    if len(ranges) > MOST_RANGES:
        raise ConfigurationError(f"axes.ranges: {len(ranges)} keys; the limit is {MOST_RANGES}.")
    if block.kind is Sampling.LATIN_HYPERCUBE:
        unit = qmc.LatinHypercube(d=len(ranges), rng=seed).random(block.samples)
    else:
        if block.samples & (block.samples - 1):
            raise ConfigurationError(
                f"axes of kind 'sobol': samples = {block.samples} must be a power of two, "
                f"such as {1 << (block.samples - 1).bit_length()}; others lose the sequence's balance."
            )
        unit = qmc.Sobol(d=len(ranges), rng=seed).random(block.samples)
    for row in unit:
        yield {
            key: _in_unit(low + float(share) * (high - low), text)
            for share, (key, (low, high, text)) in zip(row, ranges.items(), strict=True)
        }


def _range(key: str, ends: object) -> tuple[float, float, str]:
    """Least value, largest value and their unit, empty for plain numbers."""
    if isinstance(ends, Sequence) and not isinstance(ends, str) and len(ends) == 2:
        found = [NUMBER_AND_UNIT.fullmatch(str(end)[: LONGEST_TEXT + 1]) for end in ends]
        if found[0] and found[1] and found[0][2] == found[1][2]:
            low, high = float(found[0][1]), float(found[1][1])
            if 0 < high - low < math.inf:
                return low, high, found[0][2]
    raise ConfigurationError(
        f"axes.ranges.{key}: expected the least and the largest value in one unit, such as ['127 rpm', '997 rpm'], "
        f"found {shown(ends)}."
    )


def _in_unit(value: float, unit: str) -> float | str:
    return f"{value!r} {unit}" if unit else value
