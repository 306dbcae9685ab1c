"""What is assumed beside the model's inputs, from `budget.toml`: priors of errors, how the inputs are studied."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from srbval.config.strict import build, read_toml
from srbval.errors import ConfigurationError

BUDGET = Path(str(resources.files("srbval.validation") / "budget.toml"))


@dataclass(frozen=True, kw_only=True)
class Prior:
    """Scales of errors that no data settle: half-normal of levels [dB], standard deviation of the cage ratio [%]."""

    mounting_db: float
    discrepancy_db: float
    discrepancy_pct: float

    def __post_init__(self) -> None:
        if min(vars(self).values()) <= 0:
            raise ConfigurationError(f"{BUDGET.name} prior: every scale must be above 0, found {vars(self)}.")


@dataclass(frozen=True, kw_only=True)
class StudySettings:
    """How the study of the inputs is made, see `budget.toml`."""

    draws: int
    least_draws: int
    least_read: float
    most_outside: float
    most_left_over: float
    rounds: int
    predicted: int
    bins: int
    seed: int
    grid_safety: float
    grid_least_order: float
    grid_most_order: float

    def __post_init__(self) -> None:
        shares = all(0 < one < 1 for one in (self.least_read, self.most_outside, self.most_left_over))
        counts = min(self.rounds, self.bins) >= 1 and 3 <= self.least_draws <= self.draws <= self.predicted
        if not (shares and counts and 0 < self.grid_least_order < self.grid_most_order and self.grid_safety >= 1):
            raise ConfigurationError(f"{BUDGET.name} study: shares in 0 to 1, counts and orders that rise are needed.")


def _table(name: str) -> dict[str, object]:
    return dict(read_toml(BUDGET).get(name, {}))


PRIOR = build(Prior, _table("prior"), f"{BUDGET.name} prior")
STUDY = build(StudySettings, _table("study"), f"{BUDGET.name} study")
