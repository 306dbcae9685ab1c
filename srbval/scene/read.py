"""Read scenes from TOML files: the scene of Giraudo et al. 2025 ("the paper"), and files that change some values.

The bundled scene `rig` models the paper's test rig; `rig_inputs.toml` contains the ranges of its uncertain values.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, Bearing, load_bearing
from srbval.errors import ConfigurationError, UnknownNameError
from srbval.scene.parts import LoadPath
from srbval.scene.scene import MAX_DEFECTS, Scene
from srbval.storage.tables import SI_SUFFIX, build, nest_value, read_toml

PAPER_SCENE = "paper"
BUNDLED = (PAPER_SCENE, "rig", "rig-oil")  # scenes of the package, each a file beside this module
BASE_SCENES = {"rig-oil": "rig"}  # bundled scenes that change another one
DRILL = "2 mm"  # diameter of the rig's drill, section 3.2
NO_PATH = "none"
DRAWS_SEED = 17
BUNDLED_PATHS = {NO_PATH: "", "rig": "sensor_path_rig"}  # file of each name; `srbval identify` writes such files
SIZE_TOLERANCE = 1e-9  # relative difference below which two sizes are equal
# Power of the size by which a value of a similar machine scales, by the end of its name (the first that fits): lengths
# and stiffnesses scale with the size, forces and dampings with its square, masses with its cube.
SIZE_POWERS = {"_ns_m": 2, "_n_m": 1, "_kg": 3, "_n": 2, "_m": 1}
# A bearing in its machine carries the whole load: there is no spring or damper beside it.
IN_ITS_MACHINE: dict[str, Any] = {"load": {"path": "bearing"}, "housing": {"damping": "0 Ns/m"}}
# A machine of another size has the damping of the rig's joints: see `rig_inputs.toml`.
IN_ANOTHER_MACHINE = IN_ITS_MACHINE | {"housing": {"damping": "3.1e4 Ns/m"}}
# Ball and cylindrical roller bearings also have the rig's drilled hole, scaled with the bearing.
NOT_SPHERICAL = IN_ITS_MACHINE | {"model": "planar", "defect": {"shape": "hole", "extent": "2 mm", "height": "-0.5 mm"}}
DAMPING_RATIO = 0.05  # assumed, of the housing on its spring; with the paper's 0.41 there is no resonance


def paper_scene(**changes: Any) -> Scene:
    """Build the scene of Giraudo et al. 2025 (Table 4, 710 rpm, 124.8 kN) with `changes`.

    `changes` are top-level keys of a scene file, e.g. ``duration="2 s"``, ``defect={"kind": "outer"}``, or in short
    ``defect="outer"``. For another `bearing` all other values scale with its size, see `for_bearing`.
    """
    return _scene(_spelled_out(changes), "scene")


def _spelled_out(changes: Mapping[str, Any]) -> Mapping[str, Any]:
    """Replace ``defect="outer"`` by its table ``{"kind": "outer"}``; other changes stay as they are."""
    kind = changes.get("defect")
    return {**changes, "defect": {"kind": kind}} if isinstance(kind, str) else changes


def load_scene(path: str | Path, changes: Mapping[str, Any] | None = None) -> Scene:
    """Read a bundled scene by its name, e.g. ``rig``, or a TOML file; without suffix it needs its folder: ``./mine``.

    Missing keys keep the values of `paper_scene`; `changes` override the file. Raises `DataError` for a missing file,
    `ConfigurationError` for an unknown name or key (with the nearest known one), a wrong unit or an impossible value.
    """
    given = scene_table(path)
    over = _spelled_out(changes or {})
    if str(path) in BUNDLED:  # a bundled scene is written for its bearing, a user's file for the user's
        return _scene(over, str(path), merge(bundled_table(PAPER_SCENE), given))
    return _scene(merge(given, over), str(path))


def scene_table(scene: str | Path, folder: str | Path = "") -> Mapping[str, Any]:
    """Read the TOML table of a bundled scene, or of a scene file in `folder`; do not modify the result."""
    return _named_table("scene", str(scene), {name: name for name in BUNDLED}, folder)


def _named_table(what: str, name: str, bundled: Mapping[str, str], folder: str | Path = "") -> Mapping[str, Any]:
    if name in bundled:
        return bundled_table(bundled[name])
    if not Path(name).suffix and name == Path(name).name:
        advice = f"for a file write {name}.toml or ./{name}"
        raise UnknownNameError.of(f"{what} {name!r} is not known: {advice}", name, bundled)
    return read_toml(Path(folder) / name)


@cache
def bundled_table(name: str) -> Mapping[str, Any]:
    """Read the bundled file ``NAME.toml``; missing keys come from its base scene, if any; do not modify the result."""
    table = read_toml(Path(__file__).with_name(f"{name}.toml"))
    return merge(bundled_table(BASE_SCENES[name]), table) if name in BASE_SCENES else table


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Merge `over` into `base`, also in nested tables; keys with and without unit (``radial_n``) replace each other."""
    merged = dict(base)
    for key, value in over.items():
        for suffix in SI_SUFFIX.values():
            merged.pop(key + suffix, None)
            if key.endswith(suffix):
                merged.pop(key.removesuffix(suffix), None)
        old = merged.get(key)
        merged[key] = merge(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return merged


def for_bearing(base: Mapping[str, Any], name: object, path: object = None) -> Mapping[str, Any]:
    """Scale `base`, the table of a scene (a simulation's input) for the default bearing, to the bearing `name`.

    `path` is the user's value of the key ``load.path``. A bearing of the default geometry needs no scaling: `base` is
    returned, without the housing's spring and damper if `path` is ``bearing``. For another geometry, load, contact,
    housing, masses, defect and time step scale with the pitch diameter, and the rollers carry the whole load unless
    `path` is ``housing``. For a bearing without dimensions only the model changes, to ``kinematic``.
    """
    bearing = load_bearing(name if isinstance(name, str) else str(base["bearing"]))
    if (size := size_of(bearing)) is None:
        return merge(base, {"model": "kinematic"})
    if bearing.geometry == load_bearing(str(base["bearing"])).geometry:
        return merge(base, IN_ITS_MACHINE) if path == LoadPath.BEARING else base
    changes = {} if path == LoadPath.HOUSING else IN_ANOTHER_MACHINE
    table = merge(base, NOT_SPHERICAL if bearing.geometry is None else changes)
    return merge(table, for_size(build(Scene, table, "scene"), size, spherical=bearing.geometry is not None))


def size_of(bearing: Bearing) -> float | None:
    """Divide a bearing's pitch diameter by the default bearing's; None for a bearing without dimensions."""
    own, usual = bearing.pitch_diameter_m, load_bearing(DEFAULT_BEARING).pitch_diameter_m
    return None if own is None or usual is None else own / usual


def for_size(base: Scene, size: float, *, spherical: bool) -> dict[str, Any]:
    """Scale the values of `base` to a bearing `size` times as large at the same shaft speed, see `SIZE_POWERS`.

    Returns changes of a scene's table, in SI. Natural periods, and so the step, scale with the size; stresses and the
    friction law's velocity do not change (dimensional analysis with the same materials; Bridgman 1922). If the bearing
    is not `spherical`, its model ignores the step; the housing's damping ratio is then `DAMPING_RATIO`.
    """
    table: dict[str, Any] = {part: {} for part in ("load", "contact", "housing", "bodies", "defect")}
    for part, changes in table.items():
        for key, value in vars(getattr(base, part)).items():
            power = next((power for end, power in SIZE_POWERS.items() if key.endswith(end)), 0)
            if power and value:
                changes[key] = value * size**power
    if spherical:
        steps = max(1, math.ceil(base.steps_per_output / size - SIZE_TOLERANCE))
        return table | {"solver": {"step_s": 1 / (base.output_rate_hz * steps)}}
    mass_kg, stiffness_n_m = base.housing.mass_kg * size**3, base.housing.stiffness_n_m * size
    damping = 2 * DAMPING_RATIO * math.sqrt(mass_kg * stiffness_n_m)
    return table | {"housing": table["housing"] | {"damping_ns_m": damping}}


def _scene(table: Mapping[str, Any], where: str, base: Mapping[str, Any] | None = None) -> Scene:
    load = table.get("load")
    path = load.get("path") if isinstance(load, Mapping) else None
    base = for_bearing(_with_oil(base or bundled_table(PAPER_SCENE)), table.get("bearing"), path)
    merged = _with_oil(merge(base, table))
    further = merged.get("further_defects", [])
    if isinstance(further, list):  # each further defect also changes the paper's defect
        if len(further) >= MAX_DEFECTS:
            raise ConfigurationError(f"{where}: {1 + len(further)} defects; the limit is {MAX_DEFECTS}.")
        merged["further_defects"] = [
            _with_extent(merge(base["defect"], d)) if isinstance(d, Mapping) else d for d in further
        ]
    if isinstance(merged.get("defect"), Mapping):
        merged["defect"] = _with_extent(merged["defect"])
    if isinstance(merged.get("sensor_path"), str):
        path = merged.pop("sensor_path")
        merged |= {} if path == NO_PATH else {"sensor_path": _named_table("sensor_path", path, BUNDLED_PATHS)}
    return build(Scene, merged, where)


def _with_oil(table: Mapping[str, Any]) -> dict[str, Any]:
    """Fill the table `[oil]` of a scene's table, if it has one, with the missing default values."""
    oil = table.get("oil")
    return {**table, "oil": merge(bundled_table("oil")["defaults"], oil)} if isinstance(oil, Mapping) else {**table}


def _with_extent(defect: Mapping[str, Any]) -> Mapping[str, Any]:
    """Set the extent of a roller's defect, unless stated, to `DRILL`, the diameter of the paper's drilled holes."""
    without = defect.get("kind") == "roller" and not {"extent", "extent_m"} & set(defect)
    return {**defect, "extent": DRILL} if without else defect


@dataclass(frozen=True, kw_only=True)
class UncertainInput:
    """Uncertain input of a scene, with its probability distribution.

    `keys`: dotted paths in a scene file that all get the same value, in `unit`. The value is uniform from `low` to
    `high`, log-uniform if `log`, and a factor on the scene's own value if `relative`. With two `points`, it is `low` or
    `high`. Or it is one of `choices`, equally likely; `with_choice` contains other values that change with a choice, by
    dotted path. `points`: number of evenly spaced values that a study tries; `stands_for`: physical meaning.
    `high_from`: key of an earlier input whose value replaces `high` and `nominal`, e.g. the inner osculation is at most
    the outer one.
    """

    keys: tuple[str, ...]
    source: str
    name: str = ""
    nominal: float = math.nan
    low: float = 0.0
    high: float = 0.0
    points: int = 3
    unit: str = ""
    high_from: str = ""
    stands_for: str = ""
    log: bool = False
    relative: bool = False
    choices: tuple[str, ...] = ()
    with_choice: Mapping[str, Mapping[str, float]] = field(default_factory=dict)

    @property
    def shares(self) -> tuple[float, ...]:
        """Values that a study tries, as shares of the range from 0 to 1: cumulative probabilities."""
        points = len(self.choices) or self.points
        return tuple(i / (points if self.choices else points - 1) for i in range(points))

    def value(self, share: float, high: float) -> float | str:
        """Value of the input, or its factor if `relative`, at a share (0 to 1) of the range that ends at `high`."""
        if self.choices:
            return self.choices[min(int(share * len(self.choices)), len(self.choices) - 1)]
        if self.log:
            return float(self.low * (high / self.low) ** share)
        return self.low + (float(round(share)) if self.points == 2 else share) * (high - self.low)


def rig_inputs(kind: str = "input") -> tuple[UncertainInput, ...]:
    """Read one group of the rig's uncertain inputs: ``oil``, ``position`` (of the defect) or ``input`` (all others)."""
    tables = enumerate(bundled_table("rig_inputs")[kind], start=1)
    return tuple(build(UncertainInput, table, f"rig_inputs.toml {kind} {number}") for number, table in tables)


def changes_at(
    inputs: Sequence[UncertainInput], shares: Sequence[float | None], base: Mapping[str, float] | None = None
) -> dict[str, Any]:
    """Build the `changes` for `load_scene` that set each input to a share (0 to 1) of its range; None: nominal value.

    `base` contains the scene's own values by dotted path, which are required for `relative` inputs.
    """
    values: dict[str, Any] = {}
    changes: dict[str, Any] = {}
    for one, share in zip(inputs, shares, strict=True):
        values[one.keys[0]] = one.nominal
        if share is None and not one.high_from:
            continue
        value = one.value(1.0 if share is None else share, values.get(one.high_from, one.high))
        values[one.keys[0]] = value
        own = {key: (base or {})[key] * float(value) if one.relative else value for key in one.keys}
        own |= one.with_choice.get(str(value), {})
        for key, changed in own.items():
            changes = merge(changes, nest_value(key, f"{changed!r} {one.unit}" if one.unit else changed))
    return changes


def sobol(inputs: int, power: int, *, seed: int = DRAWS_SEED) -> list[list[float]]:
    """Draw ``2**power`` points of a scrambled Sobol sequence; each is a list of one share (0 to 1) per input."""
    from scipy.stats import qmc

    sequence = qmc.Sobol(d=inputs, scramble=True, rng=np.random.default_rng(seed))
    return [shares.tolist() for shares in sequence.random_base2(power)]


def draw_rig_changes(inputs: Sequence[UncertainInput], power: int) -> list[dict[str, Any]]:
    """Draw ``2**power`` value sets of all inputs from a Sobol sequence, each as scene changes (see `changes_at`)."""
    return [changes_at(inputs, row) for row in sobol(len(inputs), power)]
