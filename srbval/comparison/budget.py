"""What is assumed beside the model's inputs; what each number is, and why, stands beside it in `budget.toml`."""

import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from importlib import resources
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from srbval.storage.tables import build, read_toml

BUDGET = Path(str(resources.files("srbval.comparison") / "budget.toml"))


class Answer(enum.StrEnum):
    """Whether an error is within a tolerance, as far as its uncertainty lets anyone tell."""

    MET = "met"
    MISSED = "missed"
    NOT_RESOLVED = "not resolved"


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Largest error of the cage ratio that counts as none [%], why, where that comes from, and an answer's `risk`."""

    limit_pct: float
    risk: float
    reason: str
    source: str

    def answer(self, p_beyond: float) -> Answer:
        """What may be stated of an error that lies beyond the limit with this chance."""
        if self.risk < p_beyond < 1 - self.risk:
            return Answer.NOT_RESOLVED
        return Answer.MET if p_beyond <= self.risk else Answer.MISSED


@dataclass(frozen=True, kw_only=True)
class Form:
    """A form of the paper's model: `changes` of its scene, and `ranges` of open inputs in place of their own."""

    name: str
    source: str
    changes: Mapping[str, Any] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)


_TABLES = read_toml(BUDGET)
TOLERANCE = build(Tolerance, _TABLES["tolerance"], f"{BUDGET.name} tolerance")
STATED = "as stated"  # of a model: by the paper, or by the scene ``rig``
FORMS = tuple(build(Form, table, f"{BUDGET.name} form {i}") for i, table in enumerate(_TABLES["form"], start=1))
PRIOR, VERDICT, STUDY = (SimpleNamespace(**_TABLES[name]) for name in ("prior", "verdict", "study"))
