"""Small campaigns for the tests: a few milliseconds of simulated time each."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

from srbval.campaign.settings import Campaign
from srbval.storage.tables import build

BAD_STEP = 4 / 61440  # far beyond what explicit Euler survives
RATE = 15360.0


def small(**changes: Any) -> Campaign:
    """Six cases of a lesser model and the full one, 5 ms each."""
    table: dict[str, Any] = {
        "name": "small",
        "outputs": ["summary", "statistics", "acceleration"],
        "scene": {"duration": "5 ms", "settle": "0 s"},
        "axes": [
            {"kind": "grid", "values": {"shaft_speed": ["400 rpm", "700 rpm", "900 rpm"]}},
            {"kind": "grid", "values": {"defect.kind": ["none", "outer"]}},
        ],
    }
    return build(Campaign, table | changes, "campaign")


def failing_point() -> dict[str, Any]:
    """A scene that the numerics lose: explicit Euler, four steps of the paper's at once."""
    return {
        "solver.name": "ode1",
        "solver.step_s": BAD_STEP,
        "output_rate_hz": RATE,
        "duration": "30 ms",
        "defect.kind": "outer",
    }


def content(folder: Path) -> dict[str, str]:
    """Digest of every result by name, and of the table."""
    files = [*(folder / "cases").glob("*/*.h5"), folder / "results.csv"]
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in files}
