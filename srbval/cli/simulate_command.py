"""``srbval simulate``: run the bundled model on a scene."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.cli.arguments import AUTO as AUTO_STEP
from srbval.cli.output import print_json, print_table
from srbval.cli.scene_options import scene_of
from srbval.errors import DataError, NumericsError
from srbval.models.hierarchy import AUTO, level_of
from srbval.models.run import RunStatus, RunSummary
from srbval.models.simulate import Step, simulate, simulate_to_file
from srbval.progress import ProgressDisplay
from srbval.scene import Scene, scene_table
from srbval.scene.read import BUNDLED
from srbval.storage.json_files import to_json

# Attributes of a run that are printed under their own names.
OF_RUN = ("seconds", "wall_s", "compile_s", "wall_per_simulated_s", "cage_ratio", "bpfo_hz", "bpfi_hz",
          "drive_power_w", "roller_load_share", "energy_imbalance", "band_rms_m_s2", "check_wall_s", "reason",
          "not_validated")  # fmt: skip


def run(options: argparse.Namespace) -> int:
    """Simulate and print what came out; a failed run leaves with exit code 4 and writes no file.

    One whose step leaves more than the tolerances, as it was given by hand or no step was fine enough, is written and
    printed, with its status, and leaves with exit code 4 as well.
    """
    scene, planned = _planned(scene_of(options), options)
    output = Path(options.output) if options.output else None
    if output is not None and not output.parent.is_dir():
        raise DataError(f"{output.parent}: no such folder to write {output.name} to. Create it or choose another -o.")
    step = _step(options)
    result = _simulate(scene, output, step)
    if not result.status.usable:
        raise NumericsError(f"run failed ({result.status}): {result.reason}. Nothing was written.")
    summary = _summary(result, output) | planned
    if options.json:
        print_json(summary, status=result.status.value)
    else:
        apart = (*planned, "not_validated")
        rows = [(k, f"{v:.6g}" if isinstance(v, float) else v) for k, v in summary.items() if k not in apart]
        print_table(("quantity", "value"), rows)
        print("\n" + "\n".join(f"not validated: {what}" for what in result.not_validated))
    if result.status is RunStatus.INACCURATE:
        kept = "printed" if output is None else f"printed and written to {output}"
        finer = "" if step is Step.AUTO else " --dt auto chooses a finer step."
        print(f"srbval: the run is inaccurate and {kept} as it is: {result.reason}.{finer}", file=sys.stderr)
        return NumericsError.exit_code
    return 0


def _planned(scene: Scene, options: argparse.Namespace) -> tuple[Scene, dict[str, Any]]:
    """The scene, its model chosen by the planner where it asks for that, and the plan for the JSON."""
    if scene.model != AUTO:
        return scene, {}
    from srbval.cli.plan_command import question_of  # the planner takes half a second to load
    from srbval.plan.plan import make_plan

    plan = make_plan(scene, question=question_of(options.question), tolerance_pct=options.tolerance)
    reason = next(c.why for c in plan.candidates if c.model == plan.chosen)
    print(f"model {plan.chosen} for {plan.question.value} within {plan.tolerance}: {reason}", file=sys.stderr)
    for outside in plan.outside:
        print(f"outside the calibration: {outside}", file=sys.stderr)
    return replace(scene, model=plan.chosen), {"plan": to_json(plan)}


def _step(options: argparse.Namespace) -> Step:
    """Chosen, unless an option or the scene's file says what it is."""
    if options.dt is not None:
        return Step.AUTO if options.dt == AUTO_STEP else Step.CHECKED
    solver = {} if options.scene in (None, *BUNDLED) else scene_table(options.scene).get("solver", {})
    return Step.CHECKED if {"step", "step_s"} & set(solver) else Step.AUTO


def _simulate(scene: Scene, output: Path | None, step: Step) -> RunSummary:
    with ProgressDisplay() as progress:
        if output is None:
            return simulate(scene, step=step, progress=progress)
        return simulate_to_file(scene, output, step=step, progress=progress)


def _summary(result: RunSummary, output: Path | None) -> dict[str, Any]:
    scene = result.scene
    return {
        "model": scene.model,
        "solver": level_of(scene.model).own_solver or scene.solver.name,
        "output_rate_hz": scene.output_rate_hz,
        "dt_s": level_of(scene.model).step_s(scene),
        **{name: getattr(result, name) for name in OF_RUN},
        "numerics": result.step_error,
        "file": str(output) if output else None,
    }
