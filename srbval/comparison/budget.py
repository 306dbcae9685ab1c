"""What is assumed beside the model's inputs, from `budget.toml`: tolerance, priors, how the inputs are studied."""

import enum
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from srbval.storage.tables import build, read_toml

BUDGET = Path(str(resources.files("srbval.comparison") / "budget.toml"))


@dataclass(frozen=True, kw_only=True)
class Prior:
    """Scales of errors that no data settle: half-normal of levels [dB], standard deviation of the cage ratio [%]."""

    mounting_db: float
    discrepancy_db: float
    discrepancy_pct: float


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


@dataclass(frozen=True, kw_only=True)
class ScanSettings:
    """How each input alone is taken over its range, see `budget.toml`."""

    points: int
    log_points: int
    turns: float
    circle_points: tuple[int, ...]
    bands_hz: tuple[tuple[float, float], ...]
    half_digit_m: float


_TABLES = read_toml(BUDGET)
PRIOR = build(Prior, _TABLES["prior"], f"{BUDGET.name} prior")
TOLERANCE = build(Tolerance, _TABLES["tolerance"], f"{BUDGET.name} tolerance")
VERDICT = build(VerdictLimits, _TABLES["verdict"], f"{BUDGET.name} verdict")
SCAN = build(ScanSettings, _TABLES["scan"], f"{BUDGET.name} scan")
STUDY = build(StudySettings, _TABLES["study"], f"{BUDGET.name} study")
