"""Scenes from TOML: the paper's scene, with a user's file or options laid over it."""

from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any

from srbval.config.strict import build, read_toml
from srbval.config.units import SI_SUFFIX
from srbval.errors import ConfigurationError
from srbval.scene.scene import MOST_DEFECTS, Scene

PAPER_FILE = "paper.toml"
DRILL = "2 mm"  # section 3.2


def paper_scene(**changes: Any) -> Scene:
    """The paper's scene (Table 4, 710 rpm, 124.8 kN), with `changes` laid over it.

    `changes` are top-level keys of a scene file, e.g. ``defect={"kind": "outer"}``, ``duration="2 s"``.
    """
    return _scene(changes, "scene")


def load_scene(path: str | Path, changes: Mapping[str, Any] | None = None) -> Scene:
    """Read a scene file; keys it leaves out keep the paper's value, `changes` overrule the file.

    Raises `DataError` for a missing file, `ConfigurationError` for an unknown key (with the nearest known
    one), a wrong unit or an impossible value.
    """
    return _scene(merge(read_toml(Path(path)), changes or {}), str(path))


def merge(base: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Lay table `over` on `base`, tables within tables; a quantity's two spellings replace each other."""
    merged = dict(base)
    for key, value in over.items():
        for suffix in SI_SUFFIX.values():
            merged.pop(key + suffix, None)
            if key.endswith(suffix):
                merged.pop(key.removesuffix(suffix), None)
        old = merged.get(key)
        merged[key] = merge(old, value) if isinstance(old, Mapping) and isinstance(value, Mapping) else value
    return merged


def _scene(table: Mapping[str, Any], where: str) -> Scene:
    base = _paper_table()
    merged = merge(base, table)
    further = merged.get("further_defects", [])
    if isinstance(further, list) and len(further) >= MOST_DEFECTS:
        raise ConfigurationError(f"{where}: {len(further)} further defects; the limit is {MOST_DEFECTS} defects.")
    if isinstance(further, list):  # each further defect, too, is laid over the paper's
        merged["further_defects"] = [
            _with_extent(merge(base["defect"], d)) if isinstance(d, Mapping) else d for d in further
        ]
    if isinstance(merged.get("defect"), Mapping):
        merged["defect"] = _with_extent(merged["defect"])
    return build(Scene, merged, where)


@cache
def _paper_table() -> Mapping[str, Any]:
    """The paper's scene file; read only."""
    return read_toml(Path(str(resources.files("srbval.scene") / PAPER_FILE)))


def _with_extent(defect: Mapping[str, Any]) -> Mapping[str, Any]:
    """A defect on a roller without an extent is as wide as the rig's drill."""
    if defect.get("kind") == "roller" and not {"extent", "extent_m"} & set(defect):
        return {**defect, "extent": DRILL}
    return defect
