"""The limits that a benchmark's results should keep; each is shown, whether met or not."""

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar

from srbval.scene import paper_scene
from srbval.studies.scenes import PAPER_STEP_S
from srbval.studies.speed_accuracy.measured import ratio_or_none
from srbval.studies.speed_accuracy.processes import Processes
from srbval.studies.speed_accuracy.row import BenchRun

REAL_TIME = 1.0  # wall seconds per simulated second
MEMORY_SECONDS = 10.0
MEMORY_LIMIT_MB = 400.0
COMPILE_LIMIT_S = 40.0
SECOND_START_LIMIT_S = 2.0
OUTER = ("play0-outer", "interference-outer")
Read = Callable[[BenchRun], float | None]
_wall: Read = operator.attrgetter("wall_per_simulated_s")
_cage: Read = operator.attrgetter("cage_error_bound")


@dataclass(frozen=True, kw_only=True)
class Target:
    """A measured `value` and the `limit` it should not exceed, in `unit`.

    Without a value nothing was measured here or, `attempted`, the run that should have given it failed.
    """

    JSON_PROPERTIES: ClassVar = ("met",)

    name: str
    value: float | None
    limit: float
    unit: str
    attempted: bool = False

    @property
    def met(self) -> bool | None:
        """Is the value within its limit? Not if its run failed; None where nothing was measured."""
        if self.value is None:
            return False if self.attempted else None
        return self.value <= self.limit


def speed_targets(rows: Sequence[BenchRun], processes: Processes | None) -> list[Target]:
    """The speed figures of the full model, from what this run of the benchmark measured."""
    return [
        *(_of_row(_row(rows, scene, "ode4", PAPER_STEP_S), _wall, f"full model, ode4 at 1/61440 s, {scene}", REAL_TIME,
                  "s/s") for scene in OUTER),
        Target(name="compile, empty store", value=processes.compile_s if processes else None,
               limit=COMPILE_LIMIT_S, unit="s"),
        Target(name="second srbval simulate --seconds 0.1", value=processes.second_start_s if processes else None,
               limit=SECOND_START_LIMIT_S, unit="s"),
        Target(name=f"peak memory of a {MEMORY_SECONDS:g} s run", value=_memory_mb(processes), limit=MEMORY_LIMIT_MB,
               unit="MB"),
    ]  # fmt: skip


def accuracy_targets(rows: Sequence[BenchRun]) -> list[Target]:
    """The default solver at its default step against limits and against ode4 at the paper's step; the closest run."""
    name, step = paper_scene().solver.name, paper_scene().solver.step_s
    play, printed = OUTER

    def own(scene: str, read: Read, what: str, limit: float, unit: str = "1") -> Target:
        return _of_row(_row(rows, scene, name, step), read, f"default ({name}), {scene}: {what}", limit, unit)

    def over_ode4(read: Read) -> Read:
        explicit = _row(rows, printed, "ode4", PAPER_STEP_S)
        return lambda row: ratio_or_none(read(row), None if explicit is None else read(explicit))

    def band(row: BenchRun) -> float | None:
        return None if row.errors is None else row.errors.band_rms_error

    def floor(row: BenchRun) -> float | None:
        return None if row.measures is None else row.measures.noise_floor

    return [
        own(play, _wall, "wall time", 0.35, "s/s"),
        own(printed, _wall, "wall time", 0.6, "s/s"),
        own(printed, _cage, "cage error", 2e-5),
        own(printed, floor, "noise floor", 1e-3),
        own(printed, band, "500-1500 Hz RMS error", 0.05),
        own(printed, over_ode4(_cage), "cage error over ode4's at 1/61440 s", 0.1),
        own(printed, over_ode4(floor), "noise floor over ode4's at 1/61440 s", 0.1),
        own(printed, over_ode4(_wall), "wall time over ode4's at 1/61440 s", 0.5),
        Target(name="least cage error of a run at real time or faster, any scene", value=_closest(rows),
               limit=2e-6, unit="1", attempted=True),
    ]  # fmt: skip


def _of_row(row: BenchRun | None, read: Read, name: str, limit: float, unit: str) -> Target:
    value = read(row) if row is not None and row.measurable else None
    return Target(name=name, value=value, limit=limit, unit=unit, attempted=row is not None)


def _row(rows: Sequence[BenchRun], scene: str, solver: str, step_s: float) -> BenchRun | None:
    own = (r for r in rows if (r.scene, r.solver) == (scene, solver) and math.isclose(r.dt_s, step_s, rel_tol=1e-6))
    return next(own, None)


def _closest(rows: Sequence[BenchRun]) -> float | None:
    errors = [_cage(r) for r in rows if r.ok and (r.wall_per_simulated_s or math.inf) <= REAL_TIME]
    return min((error for error in errors if error is not None), default=None)


def _memory_mb(processes: Processes | None) -> float | None:
    if processes is None or processes.peak_bytes is None or processes.memory_seconds < MEMORY_SECONDS * 0.999:
        return None
    return processes.peak_bytes / 1e6
