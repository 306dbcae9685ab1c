"""What a campaign file says: a base scene, axes laid over it, seeds, repeats, outputs wanted."""

import enum
import math
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path

from srbval.campaign.quantities import ALL_OUTPUTS, Output
from srbval.errors import ConfigurationError
from srbval.plan.questions import Question
from srbval.scene import merge, scene_table
from srbval.storage.tables import build, quantity, read_toml


class Sampling(enum.StrEnum):
    """How a block of axes makes its points."""

    GRID = "grid"  # every combination of `values`
    ZIP = "zip"  # the first of each of `values`, then the second of each
    LIST = "list"  # `cases` as they stand
    LATIN_HYPERCUBE = "latin-hypercube"  # `samples` points in `ranges`
    SOBOL = "sobol"


NEEDS = {
    Sampling.GRID: ("values",),
    Sampling.ZIP: ("values",),
    Sampling.LIST: ("cases",),
    Sampling.LATIN_HYPERCUBE: ("ranges", "samples"),
    Sampling.SOBOL: ("ranges", "samples"),
}


@dataclass(frozen=True, kw_only=True)
class Axes:
    """A block of axes. Keys are those of a scene file, a table's as ``"load.radial"`` or as a table.

    `values`: choices by key; `cases`: whole points; `ranges`: least and largest value by key, in one unit.
    """

    kind: Sampling
    values: dict = field(default_factory=dict)
    cases: tuple[dict, ...] = ()
    ranges: dict = field(default_factory=dict)
    samples: int = 0

    def __post_init__(self) -> None:
        given = {n for n in ("values", "cases", "ranges", "samples") if getattr(self, n)}
        needed = set(NEEDS[self.kind])
        if given != needed:
            wrong = sorted(needed - given) or sorted(given - needed)
            verb = "needs" if needed - given else "does not use"
            raise ConfigurationError(f"axes of kind {self.kind.value!r}: it {verb} {', '.join(wrong)}.")
        if self.samples < 0:
            raise ConfigurationError(f"axes: samples = {self.samples} must be above zero.")


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """A campaign file. Blocks of `axes` multiply; each point runs `repeats` times, with seeds `seed`, `seed` + 1, ...

    `question` and `tolerance_pct` are for scenes whose model is ``auto``. `scene_file`, a file or the name of a bundled
    scene, is read before `scene` is laid over it. A case may take `limit_factor` times its planned time, or
    `least_limit_s` if that is more, before its process is ended; a factor of 0 sets no limit.
    """

    name: str
    title: str = ""
    scene: dict = field(default_factory=dict)
    scene_file: str | None = None
    axes: tuple[Axes, ...] = ()
    seed: int = 0
    repeats: int = 1
    outputs: tuple[Output, ...] = (Output.SUMMARY, Output.STATISTICS)
    question: Question = Question.LINES
    tolerance_pct: float = 0.5
    limit_factor: float = 20.0
    least_limit_s: float = quantity("time", default=300.0)

    def __post_init__(self) -> None:
        if not self.name or not all(c.isalnum() or c in "-_." for c in self.name):
            raise ConfigurationError(f"campaign name = {self.name!r} must be letters, digits, '-', '_' and '.'.")
        if self.repeats < 1 or not 0 <= self.seed < 2**62:
            raise ConfigurationError(
                f"repeats = {self.repeats} must be at least 1, seed = {self.seed} zero or above, and below 2^62."
            )
        if not self.outputs:
            raise ConfigurationError(f"outputs is empty; name some of {', '.join(ALL_OUTPUTS)}.")
        if not (math.isfinite(self.tolerance_pct) and self.tolerance_pct > 0):
            raise ConfigurationError(f"tolerance_pct = {self.tolerance_pct} must be a positive number.")
        if not (math.isfinite(self.limit_factor) and self.limit_factor >= 0):
            raise ConfigurationError(f"limit_factor = {self.limit_factor} must be 0 (no limit) or above.")
        if not (math.isfinite(self.least_limit_s) and self.least_limit_s > 0):
            raise ConfigurationError(f"least_limit_s = {self.least_limit_s} must be a positive number.")

    def limit_s(self, expected_s: float) -> float | None:
        """Wall time that a case may take which should take `expected_s`; None: no limit."""
        if not self.limit_factor:
            return None
        return max(self.least_limit_s, self.limit_factor * expected_s)


def load_campaign(name: str) -> Campaign:
    """A campaign from a file, or the preset of that name.

    Raises `DataError` for a missing file, `ConfigurationError` for an unknown key or an impossible value.
    """
    if not name.endswith(".toml") and name in presets():
        return build(Campaign, read_toml(presets()[name]), name)
    if not name.endswith(".toml"):
        raise ConfigurationError(
            f"campaign {name!r} is neither a file ending in .toml nor a preset. Presets: {', '.join(presets())}."
        )
    path = Path(name)
    campaign = build(Campaign, read_toml(path), name)
    if campaign.scene_file is None:
        return campaign
    base = scene_table(campaign.scene_file, path.parent)
    return replace(campaign, scene=merge(base, campaign.scene), scene_file=None)


def presets() -> dict[str, Path]:
    """The campaigns that come with the program, by name."""
    folder = Path(str(resources.files("srbval.campaign") / "presets"))
    return {path.stem: path for path in sorted(folder.glob("*.toml"))}
