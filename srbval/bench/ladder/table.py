"""The calibration table: errors and costs of every rung on every calibration scene, as a JSON file."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from srbval.bench.ladder.cases import Case
from srbval.bench.ladder.questions import Answer, Question
from srbval.errors import DataError
from srbval.storage.strict_json import write_json

SCHEMA_VERSION = 2


@dataclass(frozen=True, kw_only=True)
class RungEntry:
    """A rung on a scene: how the run ended, its cost, its answers and their errors [%]; None: no answer.

    The cost is the wall time of the solution, as `simulate` tells it.
    """

    status: str
    wall_per_simulated_s: float | None
    answers: Mapping[Question, Answer | None]
    error_pct: Mapping[Question, float | None]


@dataclass(frozen=True, kw_only=True)
class Entry:
    """One calibration scene: the reference's answers and every rung's."""

    case: Case
    reference: Mapping[Question, Answer | None]
    rungs: Mapping[str, RungEntry]

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            **self.case.to_dict(),
            "reference": {q.value: a for q, a in self.reference.items()},
            "rungs": {
                model: {
                    "status": rung.status,
                    "wall_per_simulated_s": rung.wall_per_simulated_s,
                    "answers": {q.value: a for q, a in rung.answers.items()},
                    "error_pct": {q.value: e for q, e in rung.error_pct.items()},
                }
                for model, rung in self.rungs.items()
            },
        }


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """The table; `seconds` recorded in each run, `solver` and `step_s` of the full model as a rung.

    `entries` are those of the grid; `between`, scenes drawn within it, tell how far errors go beyond the grid's.
    """

    reference: str
    solver: str
    step_s: float
    seconds: float
    machine: Mapping[str, Any]
    entries: tuple[Entry, ...]
    between: tuple[Entry, ...]

    @property
    def models(self) -> tuple[str, ...]:
        """Rungs, in the order they were measured: up the ladder."""
        return tuple(self.entries[0].rungs)

    def to_dict(self) -> dict[str, Any]:
        """Plain values."""
        return {
            "schema_version": SCHEMA_VERSION,
            "reference": self.reference,
            "solver": self.solver,
            "step_s": self.step_s,
            "seconds": self.seconds,
            "machine": dict(self.machine),
            "entries": [entry.to_dict() for entry in self.entries],
            "between": [entry.to_dict() for entry in self.between],
        }

    def save(self, path: Path) -> None:
        """Write to `path`, whole or not at all."""
        write_json(path, self.to_dict())


def load_calibration(path: Path) -> Calibration:
    """Read a table; `DataError` naming the file where it is missing or is none."""
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
        return Calibration(
            reference=table["reference"],
            solver=table["solver"],
            step_s=table["step_s"],
            seconds=table["seconds"],
            machine=table["machine"],
            entries=tuple(_entry(e) for e in table["entries"]),
            between=tuple(_entry(e) for e in table["between"]),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise DataError(
            f"{path}: not a calibration table ({error!r}). Measure one: srbval bench --ladder -o {path.name}"
        ) from error


def _entry(table: Mapping[str, Any]) -> Entry:
    return Entry(
        case=Case(**{name: table[name] for name in ("kind", "fit", "rpm", "radial_kn", "height_mm")}),
        reference=_answers(table["reference"]),
        rungs={
            model: RungEntry(
                status=rung["status"],
                wall_per_simulated_s=rung["wall_per_simulated_s"],
                answers=_answers(rung["answers"]),
                error_pct={Question(q): e for q, e in rung["error_pct"].items()},
            )
            for model, rung in table["rungs"].items()
        },
    )


def _answers(table: Mapping[str, Any]) -> dict[Question, Answer | None]:
    return {Question(q): None if a is None else tuple(a) for q, a in table.items()}
