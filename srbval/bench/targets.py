"""What a benchmark's figures are held against. Met or not, each is shown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from srbval.bench.processes import Processes
from srbval.bench.row import BenchRun
from srbval.bench.scenes import PAPER_STEP_S
from srbval.bench.speed import HEALTHY, POINTS, TouchCost

FULL_MODEL_LIMIT = 1.0  # wall seconds per simulated second
MEMORY_SECONDS = 10.0
MEMORY_LIMIT_MB = 400.0
COMPILE_LIMIT_S = 40.0
SECOND_START_LIMIT_S = 2.0
GROWTH_LIMIT = 1.0


@dataclass(frozen=True, kw_only=True)
class Target:
    """A measured `value` and the `limit` it should not exceed, in `unit`; `value` None: not measured here."""

    name: str
    value: float | None
    limit: float
    unit: str

    @property
    def met(self) -> bool | None:
        """Is the value within its limit? None where nothing was measured."""
        return None if self.value is None else self.value <= self.limit

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self) | {"met": self.met}


def speed_targets(rows: Sequence[BenchRun], costs: Sequence[TouchCost], processes: Processes | None) -> list[Target]:
    """The speed figures of the full model, from what this run of the benchmark measured."""
    own = [_ode4(rows, scene) for scene in ("play0-outer", "interference-outer")]
    return [
        *own,
        Target(name=f"time over touching points, growth from {POINTS[0]} to {POINTS[-1]} points per circle",
               value=points_growth(costs), limit=GROWTH_LIMIT, unit="1"),
        Target(name="time per touching roller and race, play0-healthy over interference-healthy",
               value=healthy_row(costs), limit=GROWTH_LIMIT, unit="1"),
        Target(name="compile, empty store", value=processes.compile_s if processes else None,
               limit=COMPILE_LIMIT_S, unit="s"),
        Target(name="second srbval simulate --seconds 0.1", value=processes.second_start_s if processes else None,
               limit=SECOND_START_LIMIT_S, unit="s"),
        Target(name=f"peak memory of a {MEMORY_SECONDS:g} s run", value=_memory_mb(processes), limit=MEMORY_LIMIT_MB,
               unit="MB"),
    ]  # fmt: skip


def points_growth(costs: Sequence[TouchCost]) -> float | None:
    """Time per touching point at the most points over that at the fewest; above 1, what exists costs too."""
    per_point = {c.points_per_circle: c.ns_per_point for c in costs if c.scene == HEALTHY[0]}
    few, many = per_point.get(POINTS[0]), per_point.get(POINTS[-1])
    return None if few is None or many is None else many / few


def healthy_row(costs: Sequence[TouchCost]) -> float | None:
    """Time per touching roller-race pair where few touch over that where all do; above 1, idle rollers cost too."""
    per_contact = {c.scene: c.us_per_contact for c in costs if c.points_per_circle == POINTS[0]}
    some, every = (per_contact.get(scene) for scene in HEALTHY)
    return None if some is None or every is None else some / every


def _ode4(rows: Sequence[BenchRun], scene: str) -> Target:
    wall = [r.wall_per_simulated_s for r in rows
            if (r.scene, r.solver) == (scene, "ode4") and abs(r.dt_s / PAPER_STEP_S - 1) < 1e-6 and r.ok]  # fmt: skip
    return Target(
        name=f"full model, ode4 at 1/61440 s, {scene}",
        value=wall[0] if wall else None,
        limit=FULL_MODEL_LIMIT,
        unit="s/s",
    )


def _memory_mb(processes: Processes | None) -> float | None:
    if processes is None or processes.peak_bytes is None or processes.memory_seconds < MEMORY_SECONDS * 0.999:
        return None
    return processes.peak_bytes / 1e6
