"""Scene, bearing and campaign files of valid structure with hostile values; run in a process of its own.

``python -m tests.scene.hostile_scenes FOLDER FIRST COUNT STEP`` makes cases FIRST, FIRST + STEP, ... and prints a line
of JSON when each begins and one when it has ended.
"""

import dataclasses
import enum
import json
import math
import sys
import time
import tomllib
import types
import typing
import warnings
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import load_bearing
from srbval.bearing.catalogue import catalogue_rows, known_bearings
from srbval.campaign.cases import final_scene, plan_cases
from srbval.campaign.settings import MOST_CASES, Sampling, load_campaign
from srbval.errors import SrbvalError
from srbval.models.hierarchy import LEVELS
from srbval.models.simulate import simulate
from srbval.models.solvers import METHODS
from srbval.scene import Scene, load_scene
from srbval.storage.tables import RANGES, SI_SUFFIX, UNITS

SPECIAL = (0.0, -0.0, 1.0, -1.0, math.inf, -math.inf, math.nan, 5e-324, 1.7e308, 2**63 - 1, -(2**63), 10**400, True, [],
           {}, "", "x", "1e400 kN", "nan m")  # fmt: skip
DECADES = 300  # of each sign of the exponent
KNOWN = Path(sys.modules[load_bearing.__module__].__file__ or "").parent / "known"
SHORT_S = 0.003
LONG_CAMPAIGN = 2000  # cases
RATE_HZ = 20_480.0


def fields(cls: type, prefix: str = "") -> dict[str, tuple[Any, str]]:
    """Every field of a scene and of its parts by dotted key: its type and, for a quantity, its dimension."""
    found = {}
    hints = typing.get_type_hints(cls)
    for field in dataclasses.fields(cls):
        hint = hints[field.name]
        if typing.get_origin(hint) in (types.UnionType, typing.Union):
            hint = next(a for a in typing.get_args(hint) if a is not type(None))
        if dataclasses.is_dataclass(hint):
            found |= fields(typing.cast(type, hint), f"{prefix}{field.name}.")
        else:
            found[prefix + field.name] = hint, field.metadata.get("dimension", "")
    return found


FIELDS = fields(Scene)
SCALARS = [key for key, (hint, _) in FIELDS.items() if typing.get_origin(hint) is not tuple and "profile" not in key]


def value_of(rng: np.random.Generator, hint: Any, dimension: str) -> Any:
    """A value for a field: anything, something within its range, or one of its own kind."""
    kind = rng.random()
    if kind < 0.1:
        return SPECIAL[rng.integers(len(SPECIAL))]
    if isinstance(hint, type) and issubclass(hint, enum.Enum):
        members = [m.scene_word if hasattr(m, "scene_word") else m.value for m in hint]
        return members[rng.integers(len(members))]
    if hint is bool:
        return bool(rng.integers(2))
    if hint is int:
        return int(rng.choice([rng.integers(0, 60), rng.integers(60, 100_001), int(10 ** rng.uniform(0, 18))]))
    if hint is str:
        return str(rng.choice(["", "full", "ode4", "skf-6205", "\u202e", "a" * 5000, "no.toml", "/dev/zero.toml"]))
    if kind < 0.3 or not dimension:
        number = 10 ** rng.uniform(-DECADES, DECADES)
    elif kind < 0.8:
        least, most = RANGES[dimension]
        number = 10 ** rng.uniform(math.log10(max(least, most * 1e-20)), math.log10(most))
    else:
        number = 10 ** rng.uniform(-6, 6)
    number *= rng.choice([1] * 9 + [-1])
    if dimension and rng.random() < 0.3:
        return f"{number!r} {rng.choice(list(UNITS[dimension]))}".replace("np.float64(", "").replace(")", "")
    return float(number)


def put(table: dict[str, Any], key: str, value: Any, dimension: str) -> None:
    """Set a dotted key; a quantity as text goes under the key without its unit."""
    *outer, last = key.split(".")
    for name in outer:
        table = table.setdefault(name, {})
    short = last.removesuffix(SI_SUFFIX.get(dimension, "\0"))
    for name in (last, short):
        table.pop(name, None)
    table[short if isinstance(value, str) else last] = value


def toml(value: Any) -> str:
    """A value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {toml(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool | str):
        return json.dumps(value, ensure_ascii=False)
    return repr(value)


def scene_table(rng: np.random.Generator) -> dict[str, Any]:
    """A scene that is short, whose other values are hostile."""
    table: dict[str, Any] = {
        "model": LEVELS[rng.integers(len(LEVELS))].name,
        "solver": {"name": str(rng.choice(list(METHODS)))},
    }
    rate = float(rng.choice([RATE_HZ, RATE_HZ, 1000.0, 1e6, 300.0 if table["model"] in ("full", "line") else 1.0]))
    table |= {"duration_s": max(SHORT_S, 1 / rate), "settle_s": float(rng.choice([0, 0.001])), "output_rate_hz": rate}
    table["solver"]["step_s"] = 1 / (rate * max(1, round(61440 / rate * 10 ** rng.uniform(-1, 0.7))))
    if table["model"] == "line":  # with one family of solvers: others would have to be compiled for it alone
        table["solver"]["name"] = str(rng.choice(["imex1", "imex2"]))
    table["defect"] = {"kind": str(rng.choice(["none", "outer", "inner", "roller"]))}
    for key in rng.choice(SCALARS, size=rng.choice([0, 1, 1, 2, 3]), replace=False):
        hint, dimension = FIELDS[key]
        put(table, str(key), value_of(rng, hint, dimension), dimension)
    if rng.random() < 0.15:
        pointwise = table["model"] in ("full", "line")  # the others take seconds for the table of each
        count = rng.choice([0, 1, 3, 18, 300]) if pointwise else rng.choice([1, 300])
        table["further_defects"] = [defect(rng, pointwise) for _ in range(count)]
    for name, columns in (("speed_profile", ("speed_rad_s",)), ("load_profile", ("radial_n", "axial_n"))):
        if rng.random() < 0.1:
            count = int(rng.choice([0, 1, 2, 5, 1000]))
            rise = np.cumsum(10 ** rng.uniform(-12, 0, count)) if rng.random() < 0.5 else np.linspace(0, 1, count)
            times = [0.0, *rise[1:].tolist(), 1.0][:count] if rng.random() < 0.9 else [math.nan] * count
            table[name] = {"time_s": times} | {
                c: [abs(float(v)) * 10 ** float(rng.uniform(-3, 5)) for v in rng.normal(size=count)] for c in columns
            }
    return table


def defect(rng: np.random.Generator, pointwise: bool) -> dict[str, Any]:
    """A further defect, valid or nearly so."""
    kind, shape = rng.choice(["outer", "inner", "roller"]), rng.choice(["flat", "cosine"] if pointwise else ["flat"])
    return {
        "kind": str(kind), "height_m": float(rng.uniform(-1, 1)) * 1e-3, "angle_rad": float(rng.uniform(-10, 10)),
        "extent_m": float(10 ** rng.uniform(-12, -1.2)), "refinement": int(rng.integers(1, 51)), "shape": str(shape),
        "row": int(rng.integers(1, 3)), "circle": int(rng.integers(1, 4)), "roller": int(rng.integers(1, 21)),
    }  # fmt: skip


def bearing_table(rng: np.random.Generator) -> dict[str, Any]:
    """A bearing file with hostile values, of each of the three kinds."""
    name = known_bearings()[rng.integers(len(known_bearings()))] if rng.random() < 0.5 else "skf-22240"
    row = catalogue_rows().get(name)
    table = tomllib.loads((KNOWN / f"{name}.toml").read_text()) if row is None else deepcopy(dict(row))
    part = next(v for v in table.values() if isinstance(v, dict))
    if "raceway_radius" in part and rng.random() < 0.5:  # one that fits together, of any size and angle
        scale, tilt = 10 ** rng.uniform(-9, 2.5), rng.uniform(1e-6, 0.78)
        pitch = rng.uniform(0.4, 0.95) * math.cos(tilt)
        gap = 2 * (1 - pitch / math.cos(tilt))
        made = {
            "raceway_radius_m": 1.0, "pitch_radius_m": pitch, "inner_centre_radial_m": 2 * pitch,
            "inner_centre_axial_m": 2 * pitch * math.tan(tilt),
            "roller_width_m": rng.uniform(1, 6) * math.sin(tilt / 2),
            "roller_diameter_m": gap * rng.uniform(0.96, 1.04),
            "outer_diameter_m": rng.uniform(2.001, 4), "width_m": rng.uniform(0.01, 2),
        }  # fmt: skip
        part.clear()
        part |= {k: float(v * scale) for k, v in made.items()}
        part |= {"tilt_rad": float(tilt), "rollers_per_row": int(rng.integers(1, 60))}
        return table
    for key in rng.choice(list(part), size=rng.integers(0, 3), replace=False):
        old = part.pop(key)
        if isinstance(old, str) and len(old.split()) == 2 and rng.random() < 0.8:  # a number and its unit
            number, unit = old.split()
            changed = float(number) * 10 ** rng.uniform(-1, 1) if rng.random() < 0.7 else 10 ** rng.uniform(-300, 300)
            part[key] = f"{float(changed)!r} {unit}"
        else:
            part[key] = value_of(rng, int if isinstance(old, int) else float, "")
    return table


def campaign_table(rng: np.random.Generator) -> dict[str, Any]:
    """A campaign file whose axes hold hostile values."""
    table: dict[str, Any] = {"name": "hostile", "scene": scene_table(rng)}
    for key, kind in (("seed", int), ("repeats", int), ("tolerance_pct", float), ("limit_factor", float)):
        if rng.random() < 0.1:
            table[key] = value_of(rng, kind, "")
    blocks = []
    for _ in range(rng.integers(0, 3)):
        block: dict[str, Any] = {"kind": str(rng.choice(list(Sampling)))}
        keys = [str(k) for k in rng.choice(SCALARS, size=rng.integers(1, 4), replace=False)]
        if block["kind"] in ("grid", "zip"):
            count = int(rng.choice([1, 2, 1000]))
            block["values"] = {k: [value_of(rng, *FIELDS[k]) for _ in range(count)] for k in keys}
        elif block["kind"] == "list":
            block["cases"] = [{k: value_of(rng, *FIELDS[k]) for k in keys} for _ in range(3)]
        else:
            block["ranges"] = {k: [value_of(rng, float, ""), value_of(rng, float, "")] for k in keys}
            block["samples"] = int(rng.choice([1, 2, 8, 7, 2**20, 2**62, -1]))
        blocks.append(block)
    return table | {"axes": blocks}


def scenes_of(folder: Path, number: int) -> list[Scene]:
    """The scenes that case `number` asks to be run; raises what reading it raises."""
    rng = np.random.default_rng([16, number])
    kind = number % 10
    if kind == 9:
        (folder / "campaign.toml").write_text("\n".join(f"{k} = {toml(v)}" for k, v in campaign_table(rng).items()))
        campaign = load_campaign(str(folder / "campaign.toml"))
        if LONG_CAMPAIGN < math.prod((campaign.repeats, *(axes.most_points() for axes in campaign.axes))) <= MOST_CASES:
            return []  # legal; planning takes minutes
        cases = [case for case in plan_cases(campaign) if not case.refused]
        return [final_scene(campaign, case) for case in cases[:2]]
    table = scene_table(rng)
    if kind >= 7:
        (folder / "own.toml").write_text("\n".join(f"{k} = {toml(v)}" for k, v in bearing_table(rng).items()))
        table["bearing"] = str(folder / "own.toml")
    (folder / "scene.toml").write_text("\n".join(f"{k} = {toml(v)}" for k, v in table.items()))
    return [load_scene(folder / "scene.toml")]


def outcome(folder: Path, number: int) -> dict[str, Any]:
    """What became of a case: ``refused`` with the error's kind, the status of its run, or ``broken``."""
    ran: list[list[str]] = []
    try:
        for scene in scenes_of(folder, number):
            if (scene.duration_s + scene.settle_s) / min(scene.solver.step_s, 2.5e-5) > 1e5:
                ran.append(["too long to be tried"])  # but legal
                continue
            run = simulate(scene)
            ran.append([scene.model, scene.solver.name, run.status.value])
    except SrbvalError as error:
        return {"ran": ran, "refused": str(error)}
    except BaseException as error:
        import traceback

        return {"ran": ran, "broken": f"{type(error).__name__}: {error}", "where": traceback.format_exc()[-3000:]}
    return {"ran": ran}


def peak_mb() -> float:
    """Most memory that this process has held, its own (on Linux)."""
    status = Path("/proc/self/status")
    return int(status.read_text().split("VmHWM:")[1].split()[0]) / 1024 if status.is_file() else 0.0


def main(folder: Path, first: int, count: int, step: int) -> None:
    """Run the cases one after the other."""
    warnings.simplefilter("error")
    for number in range(first, first + count * step, step):
        print(json.dumps({"case": number}), flush=True)
        started = time.process_time()
        found = outcome(folder, number) | {"case": number, "seconds": time.process_time() - started}
        print(json.dumps(found | {"mb": peak_mb()}), flush=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]), *(int(word) for word in sys.argv[2:5]))
