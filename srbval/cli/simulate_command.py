"""``srbval simulate``: run the bundled model on a scene."""

from __future__ import annotations

import argparse
import math
from pathlib import Path
from typing import Any

from srbval.cli.output import print_json, print_table
from srbval.errors import DataError, NumericsError
from srbval.models.run import RunStatus, RunSummary
from srbval.report.progress import Progress
from srbval.scene import Scene, load_scene, paper_scene


def run(options: argparse.Namespace) -> int:
    """Simulate and print what came out; a failed run leaves with exit code 4 and writes no file."""
    scene = _scene(options)
    output = Path(options.output) if options.output else None
    if output is not None and not output.parent.is_dir():
        raise DataError(f"{output.parent}: no such folder to write {output.name} to. Create it or choose another -o.")
    result = _simulate(scene, output)
    if result.status is not RunStatus.OK:
        raise NumericsError(f"run failed ({result.status}): {result.reason}. Nothing was written.")
    summary = _summary(result, output)
    if options.json:
        print_json(summary, status=result.status.value)
    else:
        print_table(("quantity", "value"), [(k, f"{v:.6g}" if isinstance(v, float) else v) for k, v in summary.items()])
    return 0


def _scene(options: argparse.Namespace) -> Scene:
    changes = _changes(options)
    return load_scene(options.scene, changes) if options.scene else paper_scene(**changes)


def _changes(options: argparse.Namespace) -> dict[str, Any]:
    """The command line's options as a scene table; only what was given."""
    table = {
        "model": options.model,
        "seed": options.seed,
        "duration_s": options.seconds,
        "shaft_speed_rad_s": options.rpm and options.rpm * 2 * math.pi / 60,
        "defect": {"kind": options.defect, "height_m": _scaled(options.defect_height_mm, 1e-3)},
        "load": {"radial_n": _scaled(options.radial_kn, 1e3), "axial_n": _scaled(options.axial_kn, 1e3)},
        "solver": {"name": options.solver, "step_s": options.dt},
    }
    return _given(table)


def _scaled(value: float | None, factor: float) -> float | None:
    return None if value is None else value * factor


def _given(table: dict[str, Any]) -> dict[str, Any]:
    filled = {k: _given(v) if isinstance(v, dict) else v for k, v in table.items()}
    return {k: v for k, v in filled.items() if v is not None and v != {}}


def _simulate(scene: Scene, output: Path | None) -> RunSummary:
    from srbval.models.simulate import simulate, simulate_to_file

    with Progress() as progress:
        task = progress.add("Simulate", total=scene.settle_s + scene.duration_s)

        def shown(done_s: float) -> None:
            progress.update(task, done_s)

        if output is None:
            return simulate(scene, progress=shown)
        return simulate_to_file(scene, output, progress=shown)


def _summary(result: RunSummary, output: Path | None) -> dict[str, Any]:
    scene = result.scene
    return {
        "model": scene.model,
        "solver": scene.solver.name,
        "dt_s": scene.solver.step_s,
        "seconds": result.seconds,
        "wall_s": result.wall_s,
        "compile_s": result.compile_s,
        "wall_per_simulated_s": result.wall_per_simulated_s,
        "cage_ratio": result.cage_ratio,
        "bpfo_hz": result.bpfo_hz,
        "bpfi_hz": result.bpfi_hz,
        "roller_load_share": result.roller_load_share,
        "reason": result.reason,
        "file": str(output) if output else None,
    }
