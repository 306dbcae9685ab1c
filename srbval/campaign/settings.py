"""Campaign file: base scene, axes (the inputs that vary), seed and outputs.

A point is the set of changes that a case makes to the base scene: values by dotted key, such as ``defect.kind``.
"""

import enum
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

from srbval.campaign.results import Output
from srbval.errors import ConfigurationError
from srbval.plan.questions import Question
from srbval.scene import merge, scene_table
from srbval.storage.tables import (
    Limited,
    build,
    limited,
    number_and_unit,
    quantity,
    quote_value,
    read_toml,
    walk_leaves,
)

MAX_CASES = 2_000_000  # all are planned in memory, and each has a result file
LARGEST_SETTING = 1e12  # finite, and larger than any sensible value
MAX_RANGES = 100  # a scene has fewer numbers
Point = dict[str, Any]


class Sampling(enum.StrEnum):
    """Method by which `Axes` vary inputs: by lists of values, by complete sets of inputs, or by samples from ranges."""

    GRID = "grid"  # every combination of `values`
    ZIP = "zip"  # first elements of all `values`, then second elements, ...
    LIST = "list"  # `cases` as they are
    LATIN_HYPERCUBE = "latin-hypercube"  # `samples` points in `ranges`
    SOBOL = "sobol"


NEEDS = {Sampling.GRID: {"values"}, Sampling.ZIP: {"values"}, Sampling.LIST: {"cases"}}  # others: ranges, samples


@dataclass(frozen=True, kw_only=True)
class Axes(Limited):
    """Inputs of a scene that the method `kind` varies from case to case.

    An input is named as in a scene file, by a dotted key such as ``defect.kind`` or by nested tables. `values` contains
    a list of choices for each input, `cases` complete sets of inputs, `ranges` the lowest and the highest value of
    each input, both with the same unit. From these ranges, `samples` sets of inputs are drawn.
    """

    kind: Sampling
    values: dict = field(default_factory=dict)
    cases: tuple[dict, ...] = ()
    ranges: dict = field(default_factory=dict)
    samples: int = limited(least=0, most=MAX_CASES, default=0)

    def __post_init__(self) -> None:
        super().__post_init__()
        given = {n for n in ("values", "cases", "ranges", "samples") if getattr(self, n)}
        needed = NEEDS.get(self.kind, {"ranges", "samples"})
        if missing := sorted(needed - given):
            raise ConfigurationError(f"axes of kind {self.kind.value!r}: this kind needs {', '.join(missing)}.")
        if unused := sorted(given - needed):
            raise ConfigurationError(f"axes of kind {self.kind.value!r}: this kind does not use {', '.join(unused)}.")

    def factors(self, seed: int) -> list[list[Point]]:
        """Lists of points (changes of inputs); a case takes one point from each list. `seed` is for random samples."""
        if self.kind is Sampling.LIST:
            return [[flatten_point(case) for case in self.cases]]
        if self.kind not in (Sampling.GRID, Sampling.ZIP):
            return [self._space_filling(seed)]
        for key, choices in (values := flatten_point(self.values)).items():
            if not isinstance(choices, list) or not choices:
                found = quote_value(choices)
                raise ConfigurationError(f"axes.values.{key}: expected a list of choices, found {found}.")
        if self.kind is Sampling.GRID:
            return [[{key: choice} for choice in choices] for key, choices in values.items()]
        if len({len(v) for v in values.values()}) > 1:
            lengths = ", ".join(f"{k} {len(v)}" for k, v in values.items())
            raise ConfigurationError(f"axes of kind 'zip': all lists must be equally long; they have {lengths}.")
        return [[dict(zip(values, choice, strict=True)) for choice in zip(*values.values(), strict=True)]]

    def _space_filling(self, seed: int) -> list[Point]:
        """Sample inputs: Latin hypercube (McKay et al. 1979) or scrambled Sobol points (Sobol 1967, Owen 1998)."""
        from scipy.stats import qmc

        ranges = {key: _range(key, ends) for key, ends in flatten_point(self.ranges).items()}
        if len(ranges) > MAX_RANGES:
            raise ConfigurationError(f"axes.ranges: {len(ranges)} inputs; the limit is {MAX_RANGES}: vary fewer.")
        if self.kind is Sampling.SOBOL and self.samples & (self.samples - 1):
            raise ConfigurationError(
                f"axes of kind 'sobol': samples = {self.samples} must be a power of two, "
                f"such as {1 << (self.samples - 1).bit_length()}; other numbers cover the ranges unevenly."
            )
        method = qmc.LatinHypercube if self.kind is Sampling.LATIN_HYPERCUBE else qmc.Sobol
        shares = method(d=len(ranges), rng=seed).random(self.samples).tolist()
        return [{key: place(share) for share, (key, place) in zip(row, ranges.items(), strict=True)} for row in shares]


@dataclass(frozen=True, kw_only=True)
class Campaign(Limited):
    """Campaign file: every combination of the inputs in `axes` is a case. For several seeds, vary ``seed``.

    If a scene's model is ``auto``, the cheapest model is used that answers `question` with an error within
    `tolerance_pct` [%]. `scene` changes the base scene `scene_file`, a file or the name of a bundled scene. A case may
    take `limit_factor` times its planned time, but at least `least_limit_s` [s], before its process is ended; a factor
    of 0 sets no limit.
    """

    name: str
    title: str = ""
    scene: dict = field(default_factory=dict)
    scene_file: str | None = None
    axes: tuple[Axes, ...] = ()
    seed: int = limited(least=0, most=2**62 - 1, default=0)
    outputs: tuple[Output, ...] = (Output.SUMMARY, Output.STATISTICS)
    question: Question = Question.LINES
    tolerance_pct: float = limited(above=0, most=LARGEST_SETTING, default=0.5)
    limit_factor: float = limited(least=0, most=LARGEST_SETTING, default=20.0)
    least_limit_s: float = quantity("time", above=0, default=300.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if not self.name or not all(c.isalnum() or c in "-_." for c in self.name):
            raise ConfigurationError(
                f"campaign name = {self.name!r}: only letters, digits, '-', '_' and '.' may occur."
            )
        if not self.outputs:
            raise ConfigurationError(f"outputs is empty; choose from {', '.join(Output)}.")

    def points(self) -> Iterator[Point]:
        """Yield the changed inputs of every case: combinations of `axes`; the first changes slowest."""
        factors = [factor for number, block in enumerate(self.axes) for factor in block.factors(self.seed + number)]
        count = math.prod(map(len, factors))
        if count > MAX_CASES:
            raise ConfigurationError(f"{count:.3g} cases; the limit is {MAX_CASES}: split the campaign.")
        for parts in itertools.product(*factors):
            point = merge_points(parts)
            yield point | ({"seed": self.seed} if self.seed and "seed" not in point else {})


def campaign_of(name: str) -> Campaign:
    """Read a campaign from a file or from the preset `name`; see `load_campaign`."""
    path = Path(name) if name.endswith(".toml") else presets().get(name)
    if path is None:
        raise ConfigurationError(
            f"campaign {name!r} is neither a file ending in .toml nor a preset. Presets: {', '.join(presets())}."
        )
    campaign = build(Campaign, read_toml(path), name)
    if campaign.scene_file is None:
        return campaign
    base = scene_table(campaign.scene_file, path.parent)
    return replace(campaign, scene=merge(base, campaign.scene), scene_file=None)


def presets() -> dict[str, Path]:
    """Files of the campaigns shipped with srbval, by name."""
    folder = Path(str(resources.files("srbval.campaign") / "presets"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}


def flatten_point(table: Mapping[str, Any]) -> Point:
    """Convert nested tables of changed inputs to one table with dotted keys."""
    return merge_points({key: value} for key, value in walk_leaves(table))


def merge_points(parts: Iterable[Point]) -> Point:
    """Merge tables of changed inputs; raises `ConfigurationError` if two of them set the same key."""
    found: Point = {}
    for part in parts:
        if twice := sorted(found.keys() & part):
            raise ConfigurationError(f"axes: {twice[0]!r} is set twice; leave one out.")
        found |= part
    return found


def _range(key: str, ends: object) -> Callable[[float], float | str]:
    """Function that converts a share of a range (0 to 1) to a value: a number, or text with the unit of both ends."""
    if isinstance(ends, list) and len(ends) == 2:
        first, second = (number_and_unit(str(end)) for end in ends)
        if first and second and first[1] == second[1] and 0 < second[0] - first[0] < math.inf:
            low, size, unit = first[0], second[0] - first[0], first[1]
            return lambda share: f"{low + share * size!r} {unit}" if unit else low + share * size
    raise ConfigurationError(
        f"axes.ranges.{key}: expected the least and the largest value in one unit, such as ['127 rpm', '997 rpm'], "
        f"found {quote_value(ends)}."
    )
