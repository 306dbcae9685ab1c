"""The rig scene's amplitudes against the rig's, in m/s2: ``python -m srbval.studies.amplitudes.study [-o FILE]``.

The scene behind the path to the sensor that H 877 and OR 877 give, at each record's own speed; those two are `fit`,
IR 877, Roller 877 and H 353 `withheld`: not used, but seen. The inputs' ranges are drawn together, with where each
record's hole may lie drawn for itself, and for every draw, and for the finer run, the path is identified anew from the
outer-race run, so that what both share cancels as it does in use. Beside it four ways of guessing: a path that also
turns the phases at random, which powers do not tell; no path; the planar rung behind a path of its own; and the
outer-race record's own increment. And how far each record repeats from one half of it to the other. Waves on races and
rollers that would give H 877's level are a further part of the uncertainty.
"""

from __future__ import annotations

import argparse
import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import scipy.fft

from srbval.bearing import DEFAULT_BEARING, Fault, load_bearing
from srbval.cli.measured import this_machine
from srbval.comparison.bias import biases
from srbval.comparison.budget import VERDICT
from srbval.comparison.comparison import DATA_PARTS, Comparison, QuantityValue
from srbval.comparison.effects import INPUTS
from srbval.config.strict import read_toml
from srbval.errors import DataError, NumericsError
from srbval.models.band_levels import along_sensor
from srbval.models.run import Run
from srbval.models.sensor_filter import SensorFilter
from srbval.models.simulate import Step, simulate
from srbval.path.amplitudes import (
    NUMERICS,
    PATH,
    RMS_BANDS,
    SURFACES,
    THIRD_OCTAVES,
    crps,
    half_widths,
    kind_of,
    levels,
    pattern,
    rows,
    scaling,
    with_background,
)
from srbval.path.identify import BAND_HZ, band_powers, identify
from srbval.path.path_fit import best_of, fit_path, refit
from srbval.reading.analyse import analyse
from srbval.recordings import Recording, recording_from_run
from srbval.recordings.datasets.srbval_files import SENSOR
from srbval.recordings.registry import find_recording, load_entry
from srbval.scene import SensorPath, draws, load_scene, merge, rig_inputs
from srbval.signal import NORMAL_95
from srbval.storage.own_package import git_revision
from srbval.storage.stored_result import AMPLITUDES, COMMAND, stamped, store_result
from srbval.storage.strict_json import json_object
from srbval.studies.rows import print_rows

BEARING = load_bearing(DEFAULT_BEARING)
POWER, HEALTHY_DRAWS = 4, 4  # of two: draws of all inputs; how many of them the healthy bearing is run with
SECONDS = 2.0  # of a run, as of the records: 28 turns of the shaft, 200 or more passages
STEP_S = 1 / 61_440  # with the longest contacts the scene's own is beyond the stiffest roller's limit
FINER = {"solver": {"step_s": STEP_S / 2}, "line_contact": {"slices": 31}}
PATH_DRAWS, SEED = 24, 23
WAVE_DRAWS = 6  # seeds of the waves
WAVES = read_toml(Path(__file__).parent.parent / "waterfall" / "steps.toml")["step"][-1][
    "changes"
]  # those of H 877's level
FAULTS = {Fault.OUTER: "fit", Fault.INNER: "withheld", Fault.ROLLER: "withheld"}
FAST, SLOW = 877.0, 353.0  # nominal rpm; only the healthy bearing is at hand at both
OF_HEALTHY = "band level, healthy bearing"  # no increment: its bias stands apart


@dataclass(frozen=True, kw_only=True)
class Share:
    """Of one kind and record: how many quantities the record resolves, how many of them are near, mean and scatter.

    `crps`: mean score of the prediction, with its own uncertainty where it has one; the less the better.
    """

    record: str
    used_for: str
    predictor: str
    kind: str
    resolved: int
    near: int
    mean_error: float
    scatter: float | None
    crps: float
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
    print(f"{record.name}: {run.cage_ratio:.6f}", flush=True)
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


def shown_by(
    run: Run, state: Fault, path: SensorPath | None, healthy: Recording, seed: int | None = None
) -> dict[str, QuantityValue]:
    """Every quantity of a run behind a path; depth and kurtosis in the healthy record's background.

    With a `seed` the path also turns each harmonic of the line at random, see `turned`.
    """
    shown = behind(run, path)
    if seed is not None:
        shown = turned(shown, line_order(run, state) * run.scene.shaft_hz, seed)
    found = levels(shown, None)
    if state is Fault.HEALTHY:
        return found
    order = line_order(run, state)
    noisy = pattern(with_background(shown, healthy), BEARING, state, order)
    of_noise = {name: value for name, value in noisy.items() if depends_on_noise(name)}
    return found | pattern(shown, BEARING, state, order) | of_noise


def turned(shown: Recording, line_hz: float, seed: int) -> Recording:
    """The same powers with random phases from one harmonic of the line to the next, as a structure draws pulses out."""
    lines = scipy.fft.rfft(shown.channels[SENSOR])
    near = np.round(np.arange(lines.size) * shown.fs_hz / shown.samples / line_hz).astype(int)
    turns = np.exp(2j * math.pi * np.random.default_rng(seed).random(near[-1] + 1))
    return replace(
        shown, channels={SENSOR: scipy.fft.irfft(lines * turns[near], n=shown.samples)}, channel=SENSOR, axes=None
    )


def depends_on_noise(name: str) -> bool:
    """Does a quantity depend on the background noise?"""
    return kind_of(name) in ("modulation depth", "kurtosis")


def values(read: Mapping[str, QuantityValue]) -> dict[str, float]:
    """The plain numbers."""
    return {name: value.value for name, value in read.items()}


def drawn_paths(path: SensorPath) -> list[SensorPath]:
    """Paths with parameters drawn from the covariance, those that are none left out."""
    drawn = np.random.default_rng(SEED).multivariate_normal(path.parameters, np.array(path.covariance), PATH_DRAWS)
    return [moved for one in drawn if (moved := moved_path(path, one)) is not None]


def moved_path(path: SensorPath, parameters: np.ndarray) -> SensorPath | None:
    """The path with other parameters; None for what is no path."""
    modes = tuple(
        replace(mode, frequency_hz=math.exp(f), damping_ratio=min(math.exp(z), 0.9), gain=g)
        for mode, (f, z, g) in zip(path.modes, parameters[1:].reshape(-1, 3).tolist(), strict=True)
    )
    usable = all(100 < mode.frequency_hz < 6000 and mode.damping_ratio > 1e-3 for mode in modes)
    return replace(path, direct=math.exp(parameters[0]), modes=modes) if usable else None


def over_angle(record: Recording) -> list[dict[str, Any]]:
    """What the sensor's level does [dB] as the outer race's hole goes along the load zone, less that in its middle."""
    (angle,) = (one for one in rig_inputs("position") if one.key == "defect.angle")
    runs = {value: run_of(record, Fault.OUTER, angle.changes(value)) for value in angle.values}
    read = {value: values(levels(behind(run, None), None)) for value, run in runs.items()}
    return [
        {"angle_deg": value, "band": band, "level_db": read[value][band] - read[angle.nominal][band]}
        for value in read for band in RMS_BANDS
    ]  # fmt: skip


def study() -> tuple[list[Comparison], list[Share]]:
    """All comparisons, and what they come to."""
    healthy = measured(Fault.HEALTHY, FAST)
    records = {state: measured(state, FAST) for state in FAULTS}
    common, places = draws(rig_inputs(), POWER), draws(rig_inputs("position"), POWER + 2)
    changes = {
        state: [{}, FINER, *map(merge, common, places[i * len(common) : (i + 1) * len(common)])]
        for i, state in enumerate(FAULTS)
    }  # fmt: skip
    runs = {state: [run_of(record, state, one) for one in changes[state]] for state, record in records.items()}
    planar = {state: run_of(record, state, {"model": "planar"}) for state, record in records.items()}
    rough = {state: rough_runs(record, state) for state, record in {Fault.HEALTHY: healthy, **records}.items()}
    paths = list(identified_paths(records[Fault.OUTER], healthy, runs[Fault.OUTER]))
    (own_path,) = identified_paths(records[Fault.OUTER], healthy, [planar[Fault.OUTER]])
    as_outer = levels(records[Fault.OUTER], healthy)
    found: list[Comparison] = []
    shares: list[Share] = []
    for state, record in records.items():
        line = analyse(record, bearing=BEARING).line_of(state)
        assert record.speed is not None
        order = (line.found_hz or line.kinematic_hz) / record.speed.value_hz
        rig = levels(record, healthy) | pattern(record, BEARING, state, order)
        compare = partial(rows, rig, record=record.name, fault=state, used_for=FAULTS[state])
        model, parts = predicted(runs[state], state, paths, healthy)
        parts[SURFACES] = of_waves(rough[state], rough[Fault.HEALTHY], state, paths[0])
        own = compare(model, parts)
        found += own
        guesses = {
            "path": own,
            "path, random phases": compare(*of_phases(runs[state][0], state, paths[0], healthy)),
            "no path": compare(shown_by(runs[state][0], state, None, healthy), {}),
            "planar rung, its own path": compare(shown_by(planar[state], state, own_path, healthy), {}),
            "as OR 877": compare(as_outer, {}),
            "its own other half": other_half(record, healthy, state, order, FAULTS[state]),
        }
        shares += [share for predictor, compared in guesses.items() for share in _shares(compared, predictor)]
    at_rest = list(_healthy(healthy, [{}, FINER, *common[:HEALTHY_DRAWS]], paths))
    shares += [share for used in dict.fromkeys(row.record for row in at_rest)
               for share in _shares([row for row in at_rest if row.record == used], "path")]  # fmt: skip
    return found + at_rest, shares


def predicted(
    runs: Sequence[Run], state: Fault, paths: Sequence[SensorPath], healthy: Recording
) -> tuple[dict[str, QuantityValue], dict[str, dict[str, float]]]:
    """What the model shows, and the parts of its uncertainty; `runs`: nominal, finer, draws, each with its path."""
    model, finer, *drawn = (shown_by(run, state, path, healthy) for run, path in zip(runs, paths, strict=False))
    moved = [shown_by(runs[0], state, path, healthy) for path in drawn_paths(paths[0])]
    return model, {
        NUMERICS: {name: abs(finer[name].value - value.value) for name, value in model.items()},
        INPUTS: half_widths([values(one) for one in drawn]),
        PATH: half_widths([values(one) for one in moved]),
    }


def rough_runs(record: Recording, state: Fault) -> list[Run]:
    """The nominal scene with waves, others on each bearing."""
    place = 1 + (Fault.HEALTHY, *FAULTS).index(state)
    return [run_of(record, state, WAVES | {"seed": 10 * i + place}) for i in range(WAVE_DRAWS)]


def of_waves(
    faulty: Sequence[Run], healthy: Sequence[Run], state: Fault, path: SensorPath
) -> dict[str, float]:  # fmt: skip
    """What waves do to increments and pattern, others on the faulty bearing than on the healthy one."""
    found = []
    for one, beside in zip(faulty, healthy, strict=True):
        shown = behind(one, path)
        read = levels(shown, behind(beside, path)) | pattern(shown, BEARING, state, line_order(one, state))
        found.append({name: value for name, value in values(read).items() if not depends_on_noise(name)})
    return half_widths(found)


def other_half(
    record: Recording, healthy: Recording, state: Fault, order: float, used_for: str
) -> tuple[Comparison, ...]:  # fmt: skip
    """The record's second half as it were predicted by its first: how far the record itself repeats."""
    half = record.samples // 2
    first, second = (
        levels(part, healthy) | pattern(part, BEARING, state, order)
        for part in (part_of(record, slice(0, half)), part_of(record, slice(half, 2 * half)))
    )
    return rows(second, first, {}, record=record.name, fault=state, used_for=used_for)


def part_of(record: Recording, samples: slice) -> Recording:
    """Some of the samples of a record, with the course of the speed and its mean over them."""
    signal, speed = record.speed_signal, record.speed
    assert speed is not None
    if signal is not None:
        first, last = (round(at / record.fs_hz * signal.rate_hz) for at in (samples.start, samples.stop))
        signal = replace(signal, values_hz=signal.values_hz[first:last])
        speed = replace(speed, value_hz=float(signal.values_hz.mean()))
    channels = {name: values[samples] for name, values in record.channels.items()}
    return replace(record, channels=channels, speed_signal=signal, speed=speed)


def of_phases(
    run: Run, state: Fault, path: SensorPath, healthy: Recording
) -> tuple[dict[str, QuantityValue], dict[str, dict[str, float]]]:
    """Medians over random phases of the path, and what these do."""
    drawn = [values(shown_by(run, state, path, healthy, seed)) for seed in range(PATH_DRAWS)]
    return {
        name: QuantityValue(value=statistics.median(one[name] for one in drawn)) for name in drawn[0]
    }, {PATH: half_widths(drawn)}  # fmt: skip


def _healthy(
    fast: Recording, changes: Sequence[Mapping[str, Any]], paths: Sequence[SensorPath]
) -> Iterator[Comparison]:
    """The healthy bearing's own levels at both speeds, and by how much they rise from one to the other."""
    sides = {}
    for record, used_for in ((fast, "fit"), (measured(Fault.HEALTHY, SLOW), "withheld")):
        runs = [run_of(record, Fault.HEALTHY, one) for one in changes]
        read = [shown_by(run, Fault.HEALTHY, path, fast) for run, path in zip(runs, paths, strict=False)]
        model, parts = predicted(runs, Fault.HEALTHY, paths, fast)
        rig = levels(record, None)
        sides[used_for] = rig, read
        yield from rows(rig, model, parts, record=record.name, fault=Fault.HEALTHY, used_for=used_for)
    (fast_rig, fast_model), (slow_rig, slow_model) = sides["fit"], sides["withheld"]
    model, finer, *drawn = map(scaling, slow_model, fast_model)
    parts = {
        NUMERICS: {name: abs(finer[name].value - value.value) for name, value in model.items()},
        INPUTS: half_widths([values(one) for one in drawn]),
    }
    yield from rows(
        scaling(slow_rig, fast_rig), model, parts, record=f"{record.name} to {fast.name}", fault=Fault.HEALTHY,
        used_for="withheld",
    )  # fmt: skip


def identified_paths(fault: Recording, healthy: Recording, runs: Sequence[Run]) -> Iterator[SensorPath]:
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
            limit = VERDICT.near_db if shown[0].error_unit == "dB" else VERDICT.near_pct
            yield Share(
                record=shown[0].record, used_for=shown[0].used_for, predictor=predictor, kind=kind, resolved=len(shown),
                near=sum(abs(error) <= limit for error in errors), mean_error=statistics.fmean(errors),
                scatter=statistics.stdev(errors) if len(errors) > 1 else None, unit=shown[0].error_unit,
                crps=statistics.fmean(crps(row.error, model_u(row)) for row in shown),
            )  # fmt: skip


def model_u(row: Comparison) -> float:
    """One standard uncertainty of the model's side of a row."""
    return math.hypot(*(width for part, width in row.parts.items() if part not in DATA_PARTS)) / NORMAL_95


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
    counted = [
        replace(row, kind=OF_HEALTHY) if row.state is Fault.HEALTHY and row.kind == "band level" else row
        for row in found if row.kind != "band level" or row.quantity in THIRD_OCTAVES  # each band once
    ]  # fmt: skip
    content = {"machine": this_machine(), "comparisons": [row.to_dict() for row in found], "shares": shares,
               "bias": biases(counted), "over_angle": over_angle(measured(Fault.OUTER, FAST))}  # fmt: skip
    path = store_result(stamped(AMPLITUDES, content, command=COMMAND[AMPLITUDES], revision=revision), options.output)
    print(f"stored: {path}")


if __name__ == "__main__":
    main()
