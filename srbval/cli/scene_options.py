"""The scene that a command's options describe."""

import argparse
import math
from typing import Any

from srbval.cli.arguments import AUTO
from srbval.scene import Scene, load_scene, paper_scene


def scene_of(options: argparse.Namespace) -> Scene:
    """The scene named, or the paper's, with the options applied to it; raises what reading it raises."""
    changes = _changes(options)
    return load_scene(options.scene, changes) if options.scene else paper_scene(**changes)


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """The command line's options as a scene table; only what was given."""
    table = {
        "bearing": options.bearing,
        "model": getattr(options, "model", None),  # `plan` has no such option: it chooses the model
        "seed": options.seed,
        "duration_s": options.seconds,
        "shaft_speed_rad_s": options.rpm and options.rpm * 2 * math.pi / 60,
        "sensor_path": options.sensor_path,
        "surface": {"roughness_class": options.roughness}
        | {f"{body}_waviness_m": _scaled(options.waviness_nm, 1e-9) for body in ("outer", "inner", "roller")},
        "defect": {"kind": options.defect, "height_m": _scaled(options.defect_height_mm, 1e-3)},
        "load": {"radial_n": _scaled(options.radial_kn, 1e3), "axial_n": _scaled(options.axial_kn, 1e3)},
        "solver": {"name": options.solver, "step_s": None if options.dt == AUTO else options.dt},
    }
    return _given(table)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _given(table: dict[str, Any]) -> dict[str, Any]:
    filled = {k: _given(v) if isinstance(v, dict) else v for k, v in table.items()}
    return {k: v for k, v in filled.items() if v is not None and v != {}}
