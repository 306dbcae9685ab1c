"""From the paper's scene to the rig's, one change at a time.

Every step of `steps.toml` against OR 877 and IR 877: cage ratio, level of the healthy bearing, the increment that
the fault adds, harmonics and sidebands. Uncertainty: the record's reading; half the step, more slices and other starts;
those inputs of `rig_inputs.toml` whose nominal value the step's scene has; and the path's covariance. The path was
identified from H 877 and OR 877, and the height of the waves of the last step is the one that gives H 877's level: from
there on these records are `fit`. Every bearing has waves of its own, and each start other ones.
"""

import itertools
import math
import statistics
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from srbval.bearing import RACE_DEFECTS, Fault
from srbval.comparison.bias import biases
from srbval.comparison.compared_quantities import CAGE_RATIO, cage_of
from srbval.comparison.comparison import Comparison, QuantityValue
from srbval.comparison.effects import INPUTS
from srbval.models.run import Run
from srbval.models.simulate import Step, stored_run
from srbval.path.amplitudes import WHOLE_HZ, levels, pattern
from srbval.path.identify import behind, line_order
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.reading.locked import without_passage_lines
from srbval.recordings import Recording
from srbval.scene import Scene, SensorPath, draws, load_scene, merge, rig_inputs
from srbval.storage.tables import read_toml
from srbval.studies.harness import StudyResult, input_hashes
from srbval.studies.rig_amplitudes import (
    BEARING,
    NUMERICS,
    OF_HEALTHY,
    PATH,
    WAVES,
    drawn_paths,
    half_widths,
    measured,
    measured_entry,
    rows,
)

SECONDS, STEP_S = 1.0, 1 / 81_920  # the model of continuous races takes two of its steps in one
FINER = {"solver": {"step_s": STEP_S / 2}, "line_contact": {"slices": 31}}
STARTS = (1 - 1e-5, 1 + 1e-5)  # of the load
POWER = 2  # of two: draws of the inputs
LEVEL, HEALTHY = "RMS 400-3150 Hz", "healthy RMS 400-3150 Hz"
HARMONICS = tuple(f"harmonic {number}" for number in range(2, 6))
MEASURES = {
    "cage ratio": (CAGE_RATIO.name,), "healthy level": (HEALTHY,), "increment": (LEVEL,), "harmonics 2-5": HARMONICS,
    "sidebands at f_r": ("sidebands 1",), "sidebands at 2 f_r": ("sidebands 2",),
}  # fmt: skip
STATES = (Fault.HEALTHY, *RACE_DEFECTS)


@dataclass(frozen=True, kw_only=True)
class WaterfallStep:
    """A scene on the way: what is laid over the paper's so far."""

    name: str
    changes: Mapping[str, Any]


def steps() -> tuple[WaterfallStep, ...]:
    """All of them, in their order."""
    found, so_far = [], dict[str, Any]()
    for one in read_toml(Path(__file__).with_name("steps.toml"))["step"]:
        so_far = merge(so_far, WAVES if one.get("waves") else one.get("changes", {}))
        found.append(WaterfallStep(name=one["name"], changes=so_far))
    return tuple(found)


def variants(step: WaterfallStep) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Changes of the scene by numerics, the finer run first, and by the inputs that it has."""
    scene = load_scene("paper", step.changes)
    own = [one for one in rig_inputs() if load_scene("paper", merge(step.changes, one.changes(one.nominal))) == scene]
    starts = [{"load": {"radial_n": scene.load.radial_n * share}, "seed": 10 * n} for n, share in enumerate(STARTS, 1)]
    return [FINER, *starts], draws(own, POWER)


def scene_of(step: WaterfallStep, state: Fault, changes: Mapping[str, Any]) -> Scene:
    """The step's scene at the speed of the rig's record of that state, without its path."""
    speed = measured(state, 877.0).speed
    assert speed is not None
    own = {
        "defect": {"kind": state}, "shaft_speed_rad_s": 2 * math.pi * speed.value_hz, "duration_s": SECONDS,
        "settle_s": 0.1, "solver": {"step_s": STEP_S},
    }  # fmt: skip
    scene = load_scene("paper", merge(merge(step.changes, own), changes))
    return replace(scene, sensor_path=None, seed=scene.seed + STATES.index(state))


@cache
def _run_scene(scene: Scene) -> Run:
    run = stored_run(scene, step=Step.UNCHECKED)
    if not run.status.usable:  # the stiffest of the drawn contacts
        run = stored_run(
            replace(scene, solver=replace(scene.solver, step_s=scene.solver.step_s / 2)), step=Step.UNCHECKED
        )
    return run.require_usable(f"waterfall: {scene.model}, {scene.defect.kind}: the run")


def read(runs: Mapping[Fault, Run], state: Fault, path: SensorPath | None) -> dict[str, QuantityValue]:
    """Every quantity of a step's run, its increment over the step's own healthy run."""
    order = line_order(runs[state], BEARING)
    shown, healthy = (
        without_passage_lines(behind(runs[kind], path), BEARING, at, WHOLE_HZ)
        for kind, at in ((state, order), (Fault.HEALTHY, None))
    )
    found = levels(shown, healthy) | pattern(shown, BEARING, state, order)
    return found | {HEALTHY: levels(healthy, None)[LEVEL], CAGE_RATIO.name: QuantityValue(value=runs[state].cage_ratio)}


def of_rig(state: Fault, healthy: Recording) -> dict[str, QuantityValue]:
    """The same of the rig's record; where its line is not detected at the kinematic order, without a cage ratio."""
    record = measured(state, 877.0)
    found = analyse(record, bearing=BEARING)
    line, speed = found.line_of(state), found.speed
    found_hz = line.found_hz if line.detected and line.found_hz else line.kinematic_hz
    order = found_hz / speed.value_hz
    record = without_passage_lines(record, BEARING, order, WHOLE_HZ)
    read = levels(record, healthy) | pattern(record, BEARING, state, order) | {HEALTHY: levels(healthy, None)[LEVEL]}
    if line.detected and line.ci95_hz is not None and state in RACE_DEFECTS:
        width = order * math.hypot(line.ci95_hz / found_hz, speed.ci95_hz / speed.value_hz)
        read[CAGE_RATIO.name] = QuantityValue(
            value=cage_of(state, order, BEARING.rolling_elements), ci95=width / BEARING.rolling_elements
        )
    return read


def compared(step: WaterfallStep, rig: Mapping[Fault, Mapping[str, QuantityValue]]) -> Iterator[Comparison]:
    """The rows of one step."""
    path = load_scene("paper", step.changes).sensor_path
    numerics, inputs = variants(step)
    runs = [{state: _run_scene(scene_of(step, state, one)) for state in STATES} for one in ({}, *numerics, *inputs)]
    for state in RACE_DEFECTS:
        model, finer, *others = (read(one, state, path) for one in runs)
        values = [{name: value.value for name, value in one.items()} for one in (model, *others)]
        starts, drawn = values[: 1 + len(STARTS)], values[1 + len(STARTS) :]
        step_part = {name: abs(finer[name].value - value.value) for name, value in model.items()}
        parts = {
            NUMERICS: {name: math.hypot(step_part[name], width) for name, width in half_widths(starts).items()},
            INPUTS: half_widths(drawn),
        }  # fmt: skip
        if path is not None:
            moved = [read(runs[0], state, one) for one in drawn_paths(path)]
            parts[PATH] = half_widths([{name: value.value for name, value in one.items()} for one in moved])
        wanted = {name for names in MEASURES.values() for name in names}
        for row in rows(
            {name: value for name, value in rig[state].items() if name in wanted}, model, parts, fault=state,
            record=measured(state, 877.0).name, used_for="withheld", scene=step.name,
        ):  # fmt: skip
            fitted = path is not None and (state is Fault.OUTER or row.quantity == HEALTHY)
            yield replace(row, used_for="fit") if fitted else row


def measures(found: Sequence[Comparison]) -> Iterator[dict[str, Any]]:
    """Error and uncertainty (95 %) of each measure of the records at one step, root mean squares of several quantities.

    `shown` of its `compared` quantities show on both sides; without one there is no error.
    """
    for record, (measure, names) in itertools.product(dict.fromkeys(row.record for row in found), MEASURES.items()):
        own = {row.quantity: row for row in found if row.record == record}
        of = [own[name] for name in names if name in own]
        shown = [row for row in of if row.both_present]
        if of:
            single = len(of) == len(shown) == 1
            yield {
                "step": of[0].scene, "record": record, "used_for": of[0].used_for, "measure": measure,
                "error": shown[0].error if single else _rms([row.error for row in shown]),
                "uncertainty": _rms([row.uncertainty or 0.0 for row in shown]), "unit": of[0].error_unit,
                "shown": len(shown), "compared": len(of),
            }  # fmt: skip


def _rms(values: Sequence[float]) -> float | None:
    return math.sqrt(statistics.fmean(value * value for value in values)) if values else None


def run(_: Namespace, progress: Progress) -> StudyResult:
    """Answer the question; see `harness.StudyResult`."""
    healthy = without_passage_lines(measured(Fault.HEALTHY, 877.0), BEARING, None, WHOLE_HZ)
    rig = {state: of_rig(state, healthy) for state in RACE_DEFECTS}
    found, summary = list[Comparison](), list[dict[str, Any]]()
    for number, step in enumerate(steps()):
        progress(f"step {step.name}", number / len(steps()))
        own = list(compared(step, rig))
        found += own
        summary += measures(own)
    progress("steps", 1.0)
    first = {
        row.quantity + row.record * (row.quantity != HEALTHY): row for row in found if row.scene == steps()[0].name
    }
    paper = [
        replace(row, scene="paper", record=healthy.name, kind=OF_HEALTHY) if row.quantity == HEALTHY else
        replace(row, scene="paper") for row in first.values()
    ]  # fmt: skip
    content = {
        "seconds": SECONDS, "bias": biases(paper), "measures": summary, "rows": [row.to_dict() for row in found],
    }  # fmt: skip
    inputs = input_hashes(*(measured_entry(state, 877.0) for state in STATES))
    return StudyResult(name="waterfall", content=content, text=text_rows(summary), inputs=inputs)
