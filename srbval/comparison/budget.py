"""Assumptions beside the model's inputs, by table of `budget.toml`, which states meaning and reason of each number."""

from pathlib import Path
from types import SimpleNamespace

from srbval.storage.tables import read_toml

BUDGET = Path(__file__).with_name("budget.toml")
_TABLES = read_toml(BUDGET)
PRIOR, TOLERANCE, VERDICT, STUDY = (
    SimpleNamespace(**_TABLES[name]) for name in ("prior", "tolerance", "verdict", "study")
)
