"""What is assumed beside the model's inputs, from `budget.toml`: tolerance, priors, how the inputs are studied."""

import enum
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from srbval.errors import ConfigurationError
from srbval.storage.tables import build, read_toml

BUDGET = Path(str(resources.files("srbval.comparison") / "budget.toml"))


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


class Answer(enum.StrEnum):
    """Whether an error is within a tolerance, as far as its uncertainty lets anyone tell."""

    MET = "met"
    MISSED = "missed"
    NOT_RESOLVED = "not resolved"


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Largest error of the cage ratio that counts as none [%], why, and where that comes from."""

    limit_pct: float
    reason: str
    source: str

    def __post_init__(self) -> None:
        if not (self.limit_pct > 0 and self.reason and self.source):
            raise ConfigurationError(f"{BUDGET.name} tolerance: limit_pct above 0, reason and source are needed.")

    def answer(self, error_pct: float, uncertainty_pct: float | None) -> Answer:
        """Met or missed where the whole interval of the error says so; without an interval nothing is resolved."""
        if uncertainty_pct is None or abs(abs(error_pct) - self.limit_pct) <= uncertainty_pct:
            return Answer.NOT_RESOLVED
        return Answer.MET if abs(error_pct) < self.limit_pct else Answer.MISSED


@dataclass(frozen=True, kw_only=True)
class VerdictLimits:
    """Chance of a false "resolved"; errors below which a model agrees: of levels [dB], of depth and kurtosis [%].

    Within `near_db` and `near_pct` an amplitude counts as predicted, whatever its uncertainty.
    """

    false_resolved: float
    level_db: float
    share_pct: float
    near_db: float
    near_pct: float

    def __post_init__(self) -> None:
        if not (0 < self.false_resolved < 1 and min(vars(self).values()) > 0):
            raise ConfigurationError(f"{BUDGET.name} verdict: a chance in 0 to 1 and margins above 0 are needed.")


@dataclass(frozen=True, kw_only=True)
class ScanSettings:
    """How each input alone is taken over its range, see `budget.toml`."""

    points: int
    log_points: int
    turns: float
    circle_points: tuple[int, ...]
    bands_hz: tuple[tuple[float, float], ...]
    half_digit_m: float

    def __post_init__(self) -> None:
        if min(self.points, self.log_points) < 3 or not (self.circle_points and self.bands_hz):
            raise ConfigurationError(f"{BUDGET.name} scan: three points or more, circles and bands are needed.")


def _table(name: str) -> dict[str, object]:
    return dict(read_toml(BUDGET).get(name, {}))


PRIOR = build(Prior, _table("prior"), f"{BUDGET.name} prior")
TOLERANCE = build(Tolerance, _table("tolerance"), f"{BUDGET.name} tolerance")
VERDICT = build(VerdictLimits, _table("verdict"), f"{BUDGET.name} verdict")
SCAN = build(ScanSettings, _table("scan"), f"{BUDGET.name} scan")
STUDY = build(StudySettings, _table("study"), f"{BUDGET.name} study")
