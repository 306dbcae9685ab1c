"""Scene and bearing files of valid structure with hostile values: refused with a message, or run to a status.

`SRBVAL_SCENES=5000` reads so many files (an hour of one core); the default is a taste of them.
"""

import dataclasses
import enum
import json
import math
import os
import sys
import tomllib
import types
import typing
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.errors import SrbvalError
from srbval.models.hierarchy import MODELS
from srbval.models.run import RunStatus
from srbval.models.simulate import Step, simulate
from srbval.models.solvers import METHODS
from srbval.scene import Scene, load_scene
from srbval.storage.tables import RANGES

CASES = int(os.environ.get("SRBVAL_SCENES", "40"))
SPECIAL = (
    0.0,
    -0.0,
    -1.0,
    math.inf,
    -math.inf,
    math.nan,
    5e-324,
    1.7e308,
    2**63 - 1,
    10**400,
    True,
    [],
    {},
    "",
    "nan m",
)
WORDS = ["", "full", "ode4", "skf-6205", "\u202e", "a" * 5000, "no.toml", "/dev/zero.toml"]
DECADES = 300  # of each sign of the exponent
KNOWN = Path(sys.modules[load_bearing.__module__].__file__ or "").parent / "known"
RATE_HZ, SHORT_S = 20_480.0, 0.003
MOST_STEPS = 1e4  # of a run that is tried


def fields(cls: type, prefix: str = "") -> dict[str, tuple[Any, str]]:
    """Every field of a scene and of its parts by dotted key: its type and, for a quantity, its dimension."""
    found = {}
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        hint = hints[field.name]
        if typing.get_origin(hint) in (types.UnionType, typing.Union):
            hint = next(a for a in typing.get_args(hint) if a is not type(None))
        inner = fields(typing.cast(type, hint), f"{field.name}.") if dataclasses.is_dataclass(hint) else {}
        found |= inner or {prefix + field.name: (hint, field.metadata.get("dimension", ""))}
    return found


FIELDS = fields(Scene)
SCALARS = [key for key, (hint, _) in FIELDS.items() if typing.get_origin(hint) is not tuple and "profile" not in key]


def value_of(rng: np.random.Generator, hint: Any, dimension: str = "") -> Any:
    """A value for a field: anything, something within its range, or one of its own kind."""
    kind = rng.random()
    if kind < 0.1:
        return SPECIAL[rng.integers(len(SPECIAL))]
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        return str(rng.choice([getattr(m, "scene_word", m.value) for m in hint]))
    if hint in (bool, str):
        return bool(rng.integers(2)) if hint is bool else str(rng.choice(WORDS))
    if hint is int:
        return int(rng.choice([rng.integers(0, 60), rng.integers(60, 100_001), int(10 ** rng.uniform(0, 18))]))
    least, most = RANGES[dimension] if dimension and kind > 0.3 else (10.0**-DECADES, 10.0**DECADES)
    power = rng.uniform(math.log10(max(least, most * 1e-20, 1e-300)), math.log10(most))
    return float(10**power * rng.choice([1] * 9 + [-1]))


def toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    return json.dumps(value, ensure_ascii=False) if isinstance(value, bool | str) else repr(value)


def scene_table(rng: np.random.Generator) -> dict[str, Any]:
    """A short scene of any model, with hostile values."""
    model = str(rng.choice(MODELS))
    table: dict[str, Any] = {
        "model": model,
        "duration_s": SHORT_S,
        "settle_s": float(rng.choice([0, 0.001])),
        "output_rate_hz": RATE_HZ,
        "solver": {"name": "imex2", "step_s": 1 / (RATE_HZ * int(rng.integers(1, 6)))},
        "defect": {"kind": str(rng.choice(["none", "outer", "inner", "roller"]))},
    }
    for key in rng.choice(SCALARS, size=rng.choice([0, 0, 1, 1, 2]), replace=False):
        *outer, last = str(key).split(".")
        (table.setdefault(outer[0], {}) if outer else table)[last] = value_of(rng, *FIELDS[key])
    if rng.random() < 0.15:
        further = {
            "kind": "inner",
            "height_m": 1e-3 * float(rng.uniform(-2, 2)),
            "extent_m": 10 ** rng.uniform(-12, -1),
        }
        table["further_defects"] = [further] * int(rng.choice([0, 1, 300]))
    if rng.random() < 0.1:
        times = [0.0, *np.cumsum(10 ** rng.uniform(-12, 0, int(rng.choice([0, 1, 1000])))).tolist()]
        table["speed_profile"] = {"time_s": times, "speed_rad_s": (10 ** rng.uniform(-3, 5, len(times))).tolist()}
    return table


def bearing_table(rng: np.random.Generator) -> dict[str, Any]:
    """The default bearing's file with hostile values."""
    table = tomllib.loads((KNOWN / "skf-22240.toml").read_text(encoding="utf-8"))
    part = next(value for value in table.values() if isinstance(value, dict))
    for key in rng.choice(list(part), size=rng.integers(1, 3), replace=False):
        old = part.pop(key)
        words = old.split() if isinstance(old, str) else []
        if len(words) == 2 and rng.random() < 0.8:  # a number and its unit
            wide = DECADES if rng.random() < 0.3 else 1
            part[key] = f"{float(words[0]) * 10.0 ** rng.uniform(-wide, wide)!r} {words[1]}"
        else:
            part[key] = value_of(rng, int if isinstance(old, int) else float)
    return table


@pytest.mark.timeout(0)
@pytest.mark.filterwarnings("error")
def test_hostile_values_end_with_a_message_or_a_status(tmp_path: Path) -> None:
    ended: Counter[str] = Counter()
    for number in range(CASES):
        rng = np.random.default_rng([16, number])
        table = scene_table(rng)
        if number % 4 == 3:
            lines = [f"{key} = {toml(value)}" for key, value in bearing_table(rng).items()]
            (tmp_path / "own.toml").write_text("\n".join(lines), encoding="utf-8")
            table["bearing"] = str(tmp_path / "own.toml")
        (tmp_path / "scene.toml").write_text("\n".join(f"{k} = {toml(v)}" for k, v in table.items()), encoding="utf-8")
        try:
            scene = load_scene(tmp_path / "scene.toml")
            if (scene.duration_s + scene.settle_s) / scene.solver.step_s < MOST_STEPS and scene.solver.name in METHODS:
                ended[simulate(scene, step=Step.UNCHECKED).status.value] += 1
        except SrbvalError as error:
            ended["refused" if 0 < len(str(error)) < SrbvalError.longest + 30 else "a message of the wrong length"] += 1
        except BaseException as error:
            raise AssertionError(f"case {number}: {error!r}") from error
    assert set(ended) <= {"refused", *(status.value for status in RunStatus)}
    assert sum(ended.values()) - ended["refused"] > CASES / 10, "the solver is reached"
