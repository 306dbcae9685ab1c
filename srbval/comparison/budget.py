"""What is assumed beside the model's inputs; the meaning of each number, and its reason, stand in `budget.toml`."""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

from srbval.comparison.vocabulary import Verdict, verdict_on_tolerance
from srbval.storage.tables import build, read_toml

BUDGET = Path(str(resources.files("srbval.comparison") / "budget.toml"))


@dataclass(frozen=True, kw_only=True)
class Tolerance:
    """Largest error of the cage ratio that counts as none [%], its reason and source, and a verdict's `risk`."""

    limit_pct: float
    risk: float
    reason: str
    source: str

    def verdict(self, p_beyond: float) -> Verdict:
        """Verdict on an error that lies beyond the limit with this chance."""
        return verdict_on_tolerance(p_beyond, self.risk)


_TABLES = read_toml(BUDGET)
TOLERANCE = build(Tolerance, _TABLES["tolerance"], f"{BUDGET.name} tolerance")
PRIOR, VERDICT, STUDY = (SimpleNamespace(**_TABLES[name]) for name in ("prior", "verdict", "study"))
