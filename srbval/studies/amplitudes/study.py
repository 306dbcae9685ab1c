"""The rig scene's amplitudes against the rig's, in m/s2.

The scene behind the path to the sensor that H 877 and OR 877 give, at each record's own speed; those two are `fit`,
IR 877, Roller 877 and H 353 `withheld`: not used, but seen. The inputs' ranges are drawn together, with where each
record's hole may lie drawn for itself, and for every draw, and for the finer run, the path is identified again from the
outer-race run, so that what both share cancels as it does in use. Beside it four ways of guessing: a path that also
turns the phases at random, which powers do not tell; no path; the planar model behind a path of its own; and the
outer-race record's own increment. And how far each record repeats from one half of it to the other. Waves on races and
rollers that would give H 877's level are a further part of the uncertainty.

And what a surface does to the healthy bearing's level: the scene with surfaces of classes and heights against H 877, to
which the path was fitted, so that nothing there is a prediction; a class reaches waves of 1 to 50 mm by the power law
alone, see ``theory/surface.md``.
"""

import math
import statistics
from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from srbval.bearing import Fault
from srbval.comparison.bias import biases
from srbval.comparison.budget import VERDICT
from srbval.comparison.comparison import DATA_PARTS, Comparison, QuantityValue
from srbval.comparison.effects import INPUTS
from srbval.models.run import Run
from srbval.path.amplitudes import RMS_BANDS, THIRD_OCTAVES, band_power, levels, pattern
from srbval.path.identify import behind
from srbval.progress import Progress
from srbval.progress.tables import text_rows
from srbval.reading.analyse import analyse
from srbval.recordings import Recording
from srbval.scene import SensorPath, draws, load_scene, merge, rig_inputs
from srbval.signal import NORMAL_95
from srbval.studies.harness import Study, StudyResult
from srbval.studies.rig_amplitudes import (
    BEARING,
    FAST,
    FAULTS,
    FINER,
    HEALTHY_DRAWS,
    NUMERICS,
    OF_HEALTHY,
    PATH,
    PATH_DRAWS,
    POWER,
    SLOW,
    SURFACES,
    crps,
    half_widths,
    identified_paths,
    measured,
    of_waves,
    predicted,
    rig_inputs_read,
    rough_runs,
    rows,
    run_of,
    scaling,
    shown_by,
    values,
)

CLASSES, HEIGHTS_NM = ("N1", "N3"), (14.0, 28.0, 56.0)  # of surfaces, on every body
Row = dict[str, Any]


def over_angle(record: Recording) -> list[dict[str, Any]]:
    """What the sensor's level does [dB] as the outer race's hole goes along the load zone, less that in its middle."""
    (angle,) = (one for one in rig_inputs("position") if one.key == "defect.angle")
    runs = {value: run_of(record, Fault.OUTER, angle.changes(value)) for value in angle.values}
    read = {value: values(levels(behind(run, None), None)) for value, run in runs.items()}
    return [
        {"angle_deg": value, "band": band, "level_db": read[value][band] - read[angle.nominal][band]}
        for value in read for band in RMS_BANDS
    ]  # fmt: skip


def surfaces(record: Recording, path: SensorPath) -> Row:
    """RMS per band [m/s2] of the healthy record and of the scene with each surface; its levels over the record [dB]."""
    made: Row = {name: {"roughness_class": name} for name in CLASSES}
    for nm in HEIGHTS_NM:
        made[f"{nm:g} nm"] = {f"{body}_waviness_m": nm * 1e-9 for body in ("outer", "inner", "roller")}
    theirs = values(levels(record, None))
    rms, over = [{"surface": f"{record.name}, measured (fit)", **_rms(record), "status": ""}], list[Row]()
    for name, surface in {"round": {}, **made}.items():
        run = run_of(record, Fault.HEALTHY, {"surface": surface, "seed": 1} if surface else {})
        shown = behind(run, path)
        own = values(levels(shown, None))
        apart = {band: own[band] - theirs[band] for band in THIRD_OCTAVES}
        rms.append({"surface": name, **_rms(shown), "status": run.status.value})
        over.append({"surface": name, **apart, "mean dB": statistics.fmean(apart.values())})
    return {"rms": rms, "model_over_record_db": over}


def _rms(recording: Recording) -> dict[str, float]:
    return {name: math.sqrt(band_power(recording, band)) for name, band in RMS_BANDS.items()}


def study(progress: Progress) -> tuple[list[Comparison], list[Row]]:
    """All comparisons, and what they come to."""
    healthy = measured(Fault.HEALTHY, FAST)
    records = {state: measured(state, FAST) for state in FAULTS}
    common, places = draws(rig_inputs(), POWER), draws(rig_inputs("position"), POWER + 2)
    runs, planar = dict[Fault, list[Run]](), dict[Fault, Run]()
    for i, (state, record) in enumerate(records.items()):
        progress("runs of the scene", i / len(records))
        place = places[i * len(common) : (i + 1) * len(common)]
        runs[state] = [run_of(record, state, one) for one in ({}, FINER, *map(merge, common, place))]
        planar[state] = run_of(record, state, {"model": "planar"})
    rough = {state: rough_runs(record, state) for state, record in {Fault.HEALTHY: healthy, **records}.items()}
    paths = identified_paths(records, runs)
    (own_path,) = identified_paths(records, {state: [run] for state, run in planar.items()})
    as_outer = levels(records[Fault.OUTER], healthy)
    found, shares = list[Comparison](), list[Row]()
    for i, (state, record) in enumerate(records.items()):
        progress("comparisons", i / len(records))
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
    for used in dict.fromkeys(row.record for row in at_rest):
        shares += _shares([row for row in at_rest if row.record == used], "path")
    return found + at_rest, shares


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


def _shares(compared: Sequence[Comparison], predictor: str) -> Iterator[Row]:
    """Of each kind: how many quantities the record resolves, how many of them are near, mean and scatter of the errors.

    `crps`: mean score of the prediction, with its own uncertainty where it has one; the less the better.
    """
    groups: dict[str, list[Comparison]] = {}
    for row in compared:
        other = "RMS per band" if row.kind == "band level" else row.kind
        groups.setdefault("third octaves" if row.quantity in THIRD_OCTAVES else other, []).append(row)
    for kind, members in sorted(groups.items(), key=lambda group: group[0] != "third octaves"):
        shown = [row for row in members if row.rig.present]
        errors = [row.error for row in shown]
        if errors:
            limit = VERDICT.near_db if shown[0].error_unit == "dB" else VERDICT.near_pct
            yield {
                "record": shown[0].record, "used_for": shown[0].used_for, "predictor": predictor, "kind": kind,
                "resolved": len(shown), "near": sum(abs(error) <= limit for error in errors),
                "mean_error": statistics.fmean(errors),
                "scatter": statistics.stdev(errors) if len(errors) > 1 else None,
                "crps": statistics.fmean(crps(row.error, model_u(row)) for row in shown), "unit": shown[0].error_unit,
            }  # fmt: skip


def model_u(row: Comparison) -> float:
    """One standard uncertainty of the model's side of a row."""
    return math.hypot(*(width for part, width in row.parts.items() if part not in DATA_PARTS)) / NORMAL_95


def _run(_: Namespace, progress: Progress) -> StudyResult:
    found, shares = study(progress)
    table = [
        {"record": row.record, "used_for": row.used_for, "quantity": row.quantity, "rig": row.rig.value,
         "model": row.model.value, "error": row.error, "U": row.uncertainty, "unit": row.error_unit,
         "resolved by the rig": "yes" if row.rig.present else "no", "verdict": row.verdict.value}
        for row in found
    ]  # fmt: skip
    counted = [
        replace(row, kind=OF_HEALTHY) if row.state is Fault.HEALTHY and row.kind == "band level" else row
        for row in found if row.kind != "band level" or row.quantity in THIRD_OCTAVES  # each band once
    ]  # fmt: skip
    path = load_scene("rig", {"sensor_path": "rig"}).sensor_path
    assert path is not None
    of_surfaces = surfaces(measured(Fault.HEALTHY, FAST), path)
    content = {
        "comparisons": [row.to_dict() for row in found], "shares": shares, "bias": biases(counted),
        "over_angle": over_angle(measured(Fault.OUTER, FAST)), "surfaces": of_surfaces,
    }  # fmt: skip
    text = "\n\n".join(text_rows(part) for part in (table, shares, *of_surfaces.values()))
    return StudyResult(name="amplitudes", content=content, text=text, inputs=rig_inputs_read())


STUDY = Study(
    question="How near are the rig scene's amplitudes to the rig's, fitted and withheld?", minutes=9, run=_run
)
