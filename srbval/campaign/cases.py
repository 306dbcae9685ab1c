"""Campaign file (base scene, axes that vary inputs, seed, outputs) and its cases: scene, model, result's name, cost.

A point is the set of changes that a case makes to the base scene: values by dotted key, such as ``defect.kind``.
"""

import contextlib
import enum
import functools
import itertools
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from srbval.campaign.results import COMPUTED_BY, SIGNAL_COLUMNS, Output
from srbval.errors import ConfigurationError, DataError, NumericsError, UnknownNameError
from srbval.models.hierarchy import AUTO, check_known, level_of
from srbval.models.run_file import scene_content
from srbval.models.solvers import METHODS
from srbval.plan.measured import nearest_table
from srbval.plan.plan import make_plan
from srbval.plan.questions import Question
from srbval.scene import Scene, merge, paper_scene, scene_table
from srbval.storage import tables
from srbval.storage.content_store import content_key
from srbval.sweep.pool import right_hand_sides_per_step

MAX_CASES = 2_000_000  # all are planned in memory, and each has a result file
LARGEST_SETTING = 1e12  # finite, and larger than any sensible value
MAX_RANGES = 100  # a scene has fewer numbers
FILE_BYTES = 16_384  # size of a result file without signals
LESSER_WEIGHT = 1e-3  # cost of one output sample of a simpler model in right-hand sides of the full one, roughly
GUESSED_S = 2e-5  # wall time of one right-hand side of the full model on a slow machine
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
class Axes(tables.Limited):
    """Inputs of a scene that the method `kind` varies from case to case.

    An input is named as in a scene file, by a dotted key such as ``defect.kind`` or by nested tables. `values` contains
    a list of choices for each input, `cases` complete sets of inputs, `ranges` the lowest and the highest value of
    each input, both with the same unit. From these ranges, `samples` sets of inputs are drawn.
    """

    kind: Sampling
    values: dict = field(default_factory=dict)
    cases: tuple[dict, ...] = ()
    ranges: dict = field(default_factory=dict)
    samples: int = tables.limited(least=0, most=MAX_CASES, default=0)

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
                found = tables.quote_value(choices)
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
class Campaign(tables.Limited):
    """Campaign file: every combination of the inputs in `axes` is a case. For several seeds, vary ``seed``.

    If a scene's model is ``auto``, the cheapest model is used that answers `question` with an error within
    `tolerance_pct` [%]. `scene` changes the base scene `scene_file`, a file or the name of a bundled scene. A case may
    take `limit_factor` (0: no limit) times its planned time, but at least `least_limit_s` [s]; then its process ends.
    """

    name: str
    title: str = ""
    scene: dict = field(default_factory=dict)
    scene_file: str | None = None
    axes: tuple[Axes, ...] = ()
    seed: int = tables.limited(least=0, most=2**62 - 1, default=0)
    outputs: tuple[Output, ...] = (Output.SUMMARY, Output.STATISTICS)
    question: Question = Question.LINES
    tolerance_pct: float = tables.limited(above=0, most=LARGEST_SETTING, default=0.5)
    limit_factor: float = tables.limited(least=0, most=LARGEST_SETTING, default=20.0)
    least_limit_s: float = tables.quantity("time", above=0, default=300.0)

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
    campaign = tables.build(Campaign, tables.read_toml(path), name)
    if campaign.scene_file is None:
        return campaign
    base = scene_table(campaign.scene_file, path.parent)
    return replace(campaign, scene=merge(base, campaign.scene), scene_file=None)


def presets() -> dict[str, Path]:
    """Files of the campaigns shipped with srbval, by name."""
    return {path.stem: path for path in sorted(Path(__file__).with_name("presets").glob("*.toml"))}


def flatten_point(table: Mapping[str, Any]) -> Point:
    """Convert nested tables of changed inputs to one table with dotted keys."""
    return merge_points({key: value} for key, value in tables.walk_leaves(table))


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
        first, second = (tables.number_and_unit(str(end)) for end in ends)
        if first and second and first[1] == second[1] and 0 < second[0] - first[0] < math.inf:
            low, size, unit = first[0], second[0] - first[0], first[1]
            return lambda share: f"{low + share * size!r} {unit}" if unit else low + share * size
    raise ConfigurationError(
        f"axes.ranges.{key}: expected the least and the largest value in one unit, such as ['127 rpm', '997 rpm'], "
        f"found {tables.quote_value(ends)}."
    )


@dataclass(frozen=True, kw_only=True, slots=True)
class CampaignCase:
    """One case of a campaign.

    `key` names the result file; `point` contains the changes of the base scene by dotted key. `expected_s` is the wall
    time [s] by stored timings, None without any; `planned_s` this time or a guess; `refused` why a scene is not valid.
    """

    index: int
    key: str
    point: Mapping[str, Any]
    model: str = ""
    expected_s: float | None = None
    planned_s: float = 0.0
    expected_bytes: int = FILE_BYTES
    refused: str | None = None


def plan_cases(campaign: Campaign) -> list[CampaignCase]:
    """List all cases; if the inputs of a case give no valid scene, its `refused` contains the reason."""
    return [_plan_case(campaign, index, point) for index, point in enumerate(campaign.points())]


def scene_of_point(campaign: Campaign, point: Mapping[str, Any]) -> Scene:
    """Build the scene of a case: the campaign's base scene with the changes `point`; its model may be ``auto``."""
    changes = (tables.nest_value(key, value) for key, value in point.items())
    scene = paper_scene(**functools.reduce(merge, changes, campaign.scene))
    if scene.model == AUTO or not level_of(scene.model).outside:  # an outside model has its own solvers
        check_known("solver", scene.solver.name, tuple(METHODS))
    return scene


def _plan_case(campaign: Campaign, index: int, point: Mapping[str, Any]) -> CampaignCase:
    try:
        scene = scene_of_point(campaign, point)
        if scene.model == AUTO:
            plan = make_plan(scene, question=campaign.question, tolerance_pct=campaign.tolerance_pct)
            scene = replace(scene, model=plan.chosen)
    except UnknownNameError as error:
        known = f" Known: {', '.join(sorted(error.known))}." if error.known else ""
        raise ConfigurationError(f"campaign {campaign.name}, case {index}: {error}{known} Nothing was run.") from None
    except (ConfigurationError, NumericsError) as error:
        key = content_key(f"{json.dumps(point, sort_keys=True, default=str)} {error}", computed_by=COMPUTED_BY)
        return CampaignCase(index=index, key=key, point=point, refused=str(error))
    planned_s, expected_s = cost_of(scene)
    return CampaignCase(
        index=index,
        key=content_key(f"{' '.join(sorted(campaign.outputs))} {scene_content(scene)}", computed_by=COMPUTED_BY),
        point=point,
        model=scene.model,
        expected_s=expected_s,
        planned_s=planned_s,
        expected_bytes=FILE_BYTES
        + 8 * max(SIGNAL_COLUMNS.get(output, 0) for output in campaign.outputs) * scene.samples,
    )


def cost_of(scene: Scene) -> tuple[float, float | None]:
    """Planned and expected wall time [s] of a simulation: equal, or a rough guess and None if no timings are stored."""
    seconds, lesser = scene.settle_s + scene.duration_s, level_of(scene.model).own_solver is not None
    each = right_hand_sides_per_step(scene.solver.name)
    with contextlib.suppress(DataError):  # no measured times are stored
        table = nearest_table(scene)
        if (pace := table.pace.get(scene.model)) is not None:
            other = right_hand_sides_per_step(table.values["solver.name"]) / table.values["solver.step_s"]
            expected_s = pace * seconds * (1.0 if lesser else each / scene.solver.step_s / other)
            return expected_s, expected_s
    weight = LESSER_WEIGHT * seconds * scene.output_rate_hz if lesser else seconds * each / scene.solver.step_s
    return GUESSED_S * weight, None
