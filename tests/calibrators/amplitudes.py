"""The rig scene's amplitudes against the rig's, in m/s2: ``python -m tests.calibrators.amplitudes [-o FILE]``.

The scene behind the path to the sensor that H 877 and OR 877 give, at each record's own speed; those two are `fit`,
IR 877 and Roller 877 `withheld`: not used, but seen. The inputs' ranges are drawn together, and for every draw the path
is identified anew from that draw's outer-race run, so that what both share cancels as it does in use. Beside it two
ways of guessing: no path, and the outer-race record's own increment.
"""

from __future__ import annotations

import argparse
import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.cli.measured import this_machine
from srbval.errors import DataError, NumericsError
from srbval.models.band_levels import along_sensor
from srbval.models.run import Run
from srbval.models.sensor_filter import SensorFilter
from srbval.models.simulate import Step, simulate
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.registry import find_recording, load_entry
from srbval.scene import SensorPath, draws, load_scene, merge, rig_inputs
from srbval.storage.own_package import git_revision
from srbval.storage.stored_result import AMPLITUDES, COMMAND, stamped, store_result
from srbval.storage.strict_json import json_object
from srbval.validation.amplitudes import THIRD_OCTAVES, levels, pattern, rows, with_background
from srbval.validation.analyse import analyse
from srbval.validation.comparison import Comparison
from srbval.validation.identify import BAND_HZ, band_powers, identify
from srbval.validation.path_fit import best_of, fit_path, refit
from tests.calibrators.rows import print_rows

BEARING = load_bearing(DEFAULT_BEARING)
POWER = 2  # of two: draws of all inputs
SECONDS = 1.0  # of a run: 14 turns of the shaft, 100 or more passages
STEP_S = 1 / 61_440  # with the longest contacts the scene's own is beyond the stiffest roller's limit
PATH_DRAWS, SEED = 24, 23
FAULTS = {Fault.OUTER: "fit", Fault.INNER: "withheld", Fault.ROLLER: "withheld"}
NEAR_DB, NEAR_PCT = 4.0, 30.0  # what the project set out to reach


@dataclass(frozen=True, kw_only=True)
class Share:
    """Of one kind and record: how many quantities the record resolves, how many of them are near, mean and scatter."""

    record: str
    used_for: str
    predictor: str
    kind: str
    resolved: int
    near: int
    mean_error: float
    scatter: float | None
    unit: str


def measured(state: Fault, nominal_rpm: float) -> Recording:
    """A registered record of the rig."""
    entry = find_recording(state=state, nominal_rpm=nominal_rpm)
    if entry is None:
        raise DataError(f"{state} {nominal_rpm:g} rpm: not registered; srbval data fetch torino-excerpts.")
    return load_entry(entry)


def run_of(record: Recording, state: Fault, changes: Mapping[str, Any]) -> Run:
    """The rig scene at the record's speed."""
    assert record.speed is not None
    own = {
        "defect": {"kind": state}, "shaft_speed_rad_s": 2 * math.pi * record.speed.value_hz,
        "duration_s": SECONDS, "solver": {"step_s": STEP_S},
    }  # fmt: skip
    run = simulate(load_scene("rig", merge(own, changes)), step=Step.UNCHECKED)
    if not run.status.usable:
        raise NumericsError(f"amplitudes: the run with {changes} failed ({run.status}): {run.reason}")
    return run


def behind(run: Run, path: SensorPath | None) -> Recording:
    """What the sensor shows of it."""
    shown = SensorFilter(path, run.scene.output_rate_hz).add(along_sensor(run.acceleration_m_s2))
    return recording_from_run(replace(run, sensor_m_s2=shown))


def line_order(run: Run, state: Fault) -> float:
    """The order of the fault's line by the run's cage; a roller's by pure rolling."""
    return state.passing_order(BEARING.rolling_elements, run.cage_ratio) or state.line_order(BEARING.orders)


def shown_by(run: Run, state: Fault, path: SensorPath | None, healthy: Recording) -> dict[str, float]:
    """Every quantity of a run behind a path."""
    shown = behind(run, path)
    read = levels(shown, None) | pattern(with_background(shown, healthy), BEARING, state, line_order(run, state))
    return {name: value.value for name, value in read.items()}


def path_deviations(run: Run, state: Fault, path: SensorPath, healthy: Recording) -> dict[str, float]:
    """Standard deviation of each quantity by the path's parameters."""
    drawn = np.random.default_rng(SEED).multivariate_normal(path.parameters, np.array(path.covariance), PATH_DRAWS)
    found = [shown_by(run, state, moved, healthy) for one in drawn if (moved := moved_path(path, one)) is not None]
    return {name: statistics.stdev(one[name] for one in found) for name in found[0]}


def moved_path(path: SensorPath, parameters: np.ndarray) -> SensorPath | None:
    """The path with other parameters; None for what is no path."""
    modes = tuple(
        replace(mode, frequency_hz=math.exp(f), damping_ratio=min(math.exp(z), 0.9), gain=g)
        for mode, (f, z, g) in zip(path.modes, parameters[1:].reshape(-1, 3).tolist(), strict=True)
    )
    usable = all(100 < mode.frequency_hz < 6000 and mode.damping_ratio > 1e-3 for mode in modes)
    return replace(path, direct=math.exp(parameters[0]), modes=modes) if usable else None


def study() -> tuple[list[Comparison], list[Share]]:
    """All comparisons, and what they come to."""
    healthy = measured(Fault.HEALTHY, 877.0)
    records = {state: measured(state, 877.0) for state in FAULTS}
    changes = [{}, *draws(rig_inputs(), POWER)]
    runs = {state: [run_of(record, state, one) for one in changes] for state, record in records.items()}
    print("runs done", flush=True)
    paths = list(_paths(records[Fault.OUTER], healthy, runs[Fault.OUTER]))
    found: list[Comparison] = []
    shares: list[Share] = []
    for state, record in records.items():
        line = analyse(record, bearing=BEARING).line_of(state)
        assert record.speed is not None
        order = (line.found_hz or line.kinematic_hz) / record.speed.value_hz
        rig = levels(record, healthy) | pattern(record, BEARING, state, order)
        model = [shown_by(run, state, path, healthy) for run, path in zip(runs[state], paths, strict=True)]
        spread = path_deviations(runs[state][0], state, paths[0], healthy)
        own = rows(rig, model, spread, record=record.name, fault=state, used_for=FAULTS[state])
        found += own
        plain = rows(rig, [shown_by(runs[state][0], state, None, healthy)], {}, record=record.name, fault=state,
                     used_for=FAULTS[state])  # fmt: skip
        as_outer = {name: value.value for name, value in levels(records[Fault.OUTER], healthy).items()}
        shown = {name: value for name, value in rig.items() if name in as_outer}
        guess = rows(shown, [as_outer], {}, record=record.name, fault=state, used_for=FAULTS[state])
        for predictor, compared in (("path", own), ("no path", plain), ("as OR 877", guess)):
            shares += list(_shares(compared, predictor))
    return found, shares


def _paths(fault: Recording, healthy: Recording, runs: Sequence[Run]) -> Iterator[SensorPath]:
    """The path of each outer-race run: that of the nominal inputs in full, the others with as many modes."""
    best = None
    for run in runs:
        excitation = recording_from_run(run)
        if best is None:
            yield identify(fault, healthy, excitation, bearing=BEARING).path
        evidence = band_powers(fault, healthy, excitation, bearing=BEARING, band_hz=BAND_HZ)
        if best is None:
            best = best_of(fit_path(evidence))
        else:
            yield refit(evidence, best).path(evidence, source="a draw of the inputs")


def _shares(compared: Sequence[Comparison], predictor: str) -> Iterator[Share]:
    third_octaves = [row for row in compared if row.quantity in THIRD_OCTAVES]
    groups = {"third octaves": third_octaves}
    for row in compared:
        if row.quantity not in THIRD_OCTAVES:
            groups.setdefault("RMS per band" if row.kind == "band level" else row.kind, []).append(row)
    for kind, members in groups.items():
        shown = [row for row in members if row.rig.present]
        errors = [row.error for row in shown]
        if errors:
            limit = NEAR_DB if shown[0].error_unit == "dB" else NEAR_PCT
            yield Share(
                record=shown[0].record, used_for=shown[0].used_for, predictor=predictor, kind=kind, resolved=len(shown),
                near=sum(abs(error) <= limit for error in errors), mean_error=statistics.fmean(errors),
                scatter=statistics.stdev(errors) if len(errors) > 1 else None, unit=shown[0].error_unit,
            )  # fmt: skip


def main() -> None:
    """Run the study, print and store it."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    revision = git_revision()
    found, shares = study()
    print_rows([
        {"record": row.record, "used_for": row.used_for, "quantity": row.quantity, "rig": row.rig.value,
         "model": row.model.value, "error": row.error, "U": row.uncertainty, "unit": row.error_unit,
         "resolved by the rig": "yes" if row.rig.present else "no", "verdict": row.verdict.value}
        for row in found
    ])  # fmt: skip
    print_rows([json_object(one) for one in shares])
    content = {"machine": this_machine(), "comparisons": [row.to_dict() for row in found], "shares": shares}
    path = store_result(stamped(AMPLITUDES, content, command=COMMAND[AMPLITUDES], revision=revision), options.output)
    print(f"stored: {path}")


if __name__ == "__main__":
    main()
