"""Commands ``srbval simulate``, ``plan``, ``kinematics`` and ``bearing``."""

import argparse
import math
import sys
from dataclasses import replace
from functools import reduce
from pathlib import Path
from typing import Any

from srbval.bearing import DEFAULT_BEARING, Bearing, fault_frequencies, find_bearings, load_bearing
from srbval.cli.arguments import AUTO_STEP
from srbval.cli.output import print_result
from srbval.errors import ConfigurationError, DataError, NumericsError
from srbval.models.hierarchy import AUTO, level_of, models_of
from srbval.models.run import RunSummary, works
from srbval.models.simulate import Step, stored_summary
from srbval.models.solvers import METHODS
from srbval.progress import ProgressDisplay
from srbval.progress.tables import text_rows, text_table
from srbval.scene import LoadPath, Scene, load_scene, merge, paper_scene, scene_table
from srbval.scene.read import BUNDLED
from srbval.storage.files import check_suffix
from srbval.storage.hdf5_files import HDF5
from srbval.storage.json_files import to_json
from srbval.storage.tables import nest_value, walk_leaves

# Attributes of a run that are printed under their names.
RUN_QUANTITIES = ["seconds", "wall_s", "compile_s", "wall_per_simulated_s", "cage_ratio", "bpfo_hz", "bpfi_hz"]
RUN_QUANTITIES += ["drive_power_w", "roller_load_share", "energy_imbalance", "band_rms_m_s2", "check_wall_s"]
RUN_QUANTITIES += ["stored_utc", "reason", "not_validated"]
OIL_QUANTITIES = ["power_w", "film_um", "lambda_min", "slip_pct"]  # also printed for a scene with oil
FAULT_LINES = ("bpfo", "bpfi", "bsf", "ftf")
BEARINGS = ("name", "Z", "d mm", "D mm", "angle deg", *map(str.upper, FAULT_LINES), "models up to", "title")
NOT_TABULATED = ["reason", "not_validated", "file", "stored_utc", "compile_s", "check_wall_s", "wall_per_simulated_s"]
NOT_TABULATED += ["roller_load_share"]
SCENE_OPTIONS = ("bearing", "duration_s", "model", "seed", "sensor_path")  # options that are keys of a scene
UNIT_BY_SUFFIX = {"_m_s2": "m/s2", "_hz": "Hz", "_pct": "%", "_um": "um", "_w": "W", "_s": "s"}  # by suffix


def scene_from_options(options: argparse.Namespace) -> Scene:
    """Load the named scene (default: the paper's) and apply the options; raises the errors of `load_scene`."""
    given = {key: value for key, value in vars(options).items() if key in SCENE_OPTIONS or "." in key}
    given["shaft_speed_rad_s"] = options.rpm and options.rpm * 2 * math.pi / 60
    waviness_m = options.waviness_nm and options.waviness_nm * 1e-9
    given |= {f"surface.{body}_waviness_m": waviness_m for body in ("outer", "inner", "roller")}
    given["solver.step_s"] = None if options.dt == AUTO_STEP else options.dt
    tables = (nest_value(key, value) for key, value in given.items() if value is not None)
    changes = reduce(merge, tables, dict[str, Any]())
    return load_scene(options.scene, changes) if options.scene else paper_scene(**changes)


def run_simulate_command(options: argparse.Namespace) -> int:
    """Simulate a scene, print the result and write the signals if ``-o`` names a file.

    A failed run raises `NumericsError` (exit code 4) and writes no file. An inaccurate run, whose time step causes an
    error above the tolerances, is printed and written; it returns exit code 4, too.
    """
    output = Path(options.output) if options.output else None
    if output is not None:
        check_suffix(output, *HDF5)
        if not output.parent.is_dir():
            raise DataError(f"{output.parent}: no such folder for {output.name}. Create it or choose another -o.")
    scene, planned = _choose_model(scene_from_options(options), options)
    scene, step = _choose_step(scene, options)
    with ProgressDisplay() as progress:
        result = stored_summary(scene, output, step=step, progress=progress)
    if not result.status.usable:
        raise NumericsError(f"run failed ({result.status}): {result.reason}. Nothing was written.")
    scene = result.scene
    level, named = level_of(scene.model), RUN_QUANTITIES + OIL_QUANTITIES * (scene.oil is not None)
    summary = {
        "model": scene.model,
        "solver": level.own_solver or scene.solver.name,
        "output_rate_hz": scene.output_rate_hz,
        "dt_s": level.step_s(scene),
        **{name: getattr(result, name) for name in named + ["free_rollers"] * scene.bodies.free_rollers},
        "numerics": result.step_error and result.step_error.to_dict(),
        "file": str(output) if output else None,
    }

    def show() -> None:
        shown = to_json({name: value for name, value in summary.items() if name not in NOT_TABULATED})
        known = {name.replace(".", " "): one for name, one in walk_leaves(shown) if one is not None}
        rows = [_format_quantity(name, one) for name, one in known.items() if not name.endswith("scatter_pct")]
        print(text_table(("quantity", "value", "unit"), rows))
        print(f"\n{_describe_load_share(result)}not validated: {'; '.join(result.not_validated)}")
        with_cage = not math.isnan(result.cage_ratio)  # an outside model may have no cage
        lines = f". BPFO {result.bpfo_hz:.2f} Hz, BPFI {result.bpfi_hz:.2f} Hz" if with_cage else ""
        print(f"{result.status}: {result.reason}{lines}{f', written to {output}' if output else ''}.")

    print_result(options, summary | planned, show, status=result.status.value)
    if not works(result.status):
        kept = "printed" if output is None else f"printed and written to {output}"
        print(f"srbval: the run is inaccurate and {kept} nevertheless: {result.reason}.", file=sys.stderr)
        return NumericsError.exit_code
    return 0


def _describe_load_share(run: RunSummary) -> str:
    """Sentence on the share of the radial load that the rollers carry, in the run and at rest; empty if unknown."""
    if math.isnan(run.roller_load_share):
        return ""
    rest = "the housing spring the rest" if run.scene.load.path is LoadPath.HOUSING else "no other part carries load"
    usual = f"usual, in static balance, is {run.balanced_share:.1%}"
    return f"the rollers carry {run.roller_load_share:.1%} of the radial load ({usual}), {rest}\n"


def _format_quantity(name: str, value: Any) -> tuple[str, str, str]:
    """Return a quantity's name in words, its value as text, and its unit, which the suffix of `name` determines."""
    words, unit = name.replace("bpfo", "BPFO").replace("bpfi", "BPFI").replace("numerics", "error of the step,"), ""
    for part in name.split():
        end = next((end for end in UNIT_BY_SUFFIX if part.endswith(end)), "")
        words, unit = words.replace(end, "", 1) if end else words, UNIT_BY_SUFFIX.get(end, unit)
    words = words.replace("_", " ")
    return words, f"{value:.5g}" if isinstance(value, float) else str(value), unit


def _choose_model(scene: Scene, options: argparse.Namespace) -> tuple[Scene, dict[str, Any]]:
    """Replace the model ``auto`` of a scene by the planner's choice; returns the scene, and the plan for ``--json``."""
    if scene.model != AUTO:
        return scene, {}
    from srbval.plan.plan import make_plan  # slow import

    plan = make_plan(scene, question=options.question, tolerance_pct=options.tolerance)
    reason = next(c.why for c in plan.candidates if c.model == plan.chosen)
    print(f"model {plan.chosen} for {plan.question.value} within {plan.tolerance}: {reason}", file=sys.stderr)
    for outside in plan.outside:
        print(f"outside the measured range: {outside}", file=sys.stderr)
    return replace(scene, model=plan.chosen), {"plan": to_json(plan)}


def _choose_step(scene: Scene, options: argparse.Namespace) -> tuple[Scene, Step]:
    """Return the scene, and whether its run selects the time step (`AUTO`) or only estimates the error (`CHECKED`).

    A step stated by an option or a scene file is kept. Otherwise the run selects the step, except for an explicit
    solver, which uses the default step of the scene or of the scene `paper`, whichever is shorter.
    """
    if options.dt is not None:
        return scene, Step.AUTO if options.dt == AUTO_STEP else Step.CHECKED
    solver = {} if options.scene in (None, *BUNDLED) else scene_table(options.scene).get("solver", {})
    if {"step", "step_s"} & set(solver):
        return scene, Step.CHECKED
    if scene.solver.name not in METHODS or METHODS[scene.solver.name].implicit:
        return scene, Step.AUTO
    step_s = min(scene.solver.step_s, paper_scene().solver.step_s)
    return replace(scene, solver=replace(scene.solver, step_s=step_s)), Step.CHECKED


def run_plan_command(options: argparse.Namespace) -> int:
    """Compare all models; choose the cheapest that answers ``--question`` within tolerance, or return exit code 1."""
    from srbval.plan.plan import make_plan  # slow import
    from srbval.plan.questions import MEANING

    plan = make_plan(scene_from_options(options), question=options.question, tolerance_pct=options.tolerance)

    def show() -> None:
        asked = MEANING[plan.question]
        columns = {"model": "model", f"error [{asked.unit}]": "error", "wall [s]": "wall_s", "enough": "ok", "": "mark"}
        rows = [
            {"model": c.model, "error": c.error_pct and asked.shown(c.error_pct), "wall_s": c.wall_s}
            | {"ok": "yes" if c.ok else "no", "mark": "<-" if c.model == plan.chosen else ""}
            for c in plan.candidates
        ]
        print(f"{text_rows(rows, columns)}\n")
        for c in plan.candidates:
            if not c.ok:
                print(f"{c.model}: {c.why}")
        chosen = next(c for c in plan.candidates if c.model == plan.chosen)
        if not plan.met:
            outside = "the scene is outside the measured range"
            remedy = outside if plan.outside else "choose a wider tolerance or another question"
            print(f"No model is known to keep the tolerance: {remedy}.")
        print(f"{plan.question.value} within {plan.tolerance}: {plan.chosen} ({chosen.why}).")
        for reason in plan.outside:
            print(f"outside the measured range: {reason}", file=sys.stderr)

    return print_result(options, to_json(plan), show, code=0 if plan.met else 1)


def run_kinematics_command(options: argparse.Namespace) -> int:
    """Print the fault frequencies of a bearing and their ratios to the shaft frequency (orders)."""
    if options.name and options.bearing:
        raise ConfigurationError(f"two bearings are given, {options.name} and {options.bearing}: leave one out.")
    bearing = load_bearing(options.name or options.bearing or DEFAULT_BEARING)
    frequencies = fault_frequencies(bearing, rpm=options.rpm)

    def show() -> None:
        print(f"{bearing.title} at {options.rpm:g} rpm, outer ring at rest, no slip\n")
        rows = [(n.upper(), getattr(frequencies, f"{n}_hz"), getattr(bearing.orders, n)) for n in FAULT_LINES]
        print(text_table(("line", "Hz", "order"), [("shaft", frequencies.shaft_hz, 1.0), *rows]))

    document = vars(frequencies) | {"orders": bearing.orders, "bearing": bearing.name}
    document |= {"rolling_elements": bearing.rolling_elements, "rpm": options.rpm, "source": bearing.source}
    return print_result(options, document, show)


def run_bearing_command(options: argparse.Namespace) -> int:
    """List the known bearings that match every word of the search."""
    found = find_bearings(options.search or "")

    def show() -> None:
        print(text_table(BEARINGS, [_bearing_row(bearing) for bearing in found]))
        print(f"\n{len(found)} bearings; --json contains their sources. Others: --elements, --orders or a TOML file")

    names = ("name", "title", "source", "rolling_elements", "orders", "elements", "geometry")
    bearings = [{name: getattr(one, name) for name in names} | {"models": models_of(one)} for one in found]
    return print_result(options, {"count": len(found), "bearings": bearings}, show)


def _bearing_row(bearing: Bearing) -> tuple[object, ...]:
    sizes: tuple[float | None, ...] = (None, None, None)
    if (geometry := bearing.geometry) is not None:
        sizes = geometry.roller_diameter_m * 1e3, 2e3 * geometry.pitch_radius_m, math.degrees(geometry.tilt_rad)
    elif (own := bearing.elements) is not None:
        sizes = own.element_diameter_m * 1e3, own.pitch_diameter_m * 1e3, math.degrees(own.contact_angle_rad)
    orders = (getattr(bearing.orders, name) for name in FAULT_LINES)
    return (bearing.name, bearing.rolling_elements, *sizes, *orders, models_of(bearing)[-1], bearing.title)
