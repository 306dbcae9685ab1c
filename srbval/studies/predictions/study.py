"""Predictions of rig records before they are compared.

The scene `rig` at each record's shaft speed, behind the path to the sensor that H 877 and OR 877 give, run as the study
of amplitudes runs it: the ranges of all inputs drawn together with the position of the hole, the path identified for
each draw, waves on races and rollers as a further part. The records are OR, IR and Roller at 353 rpm,
of which the project knew no more than the orders of lines, and every registered record at the same load that the
project has never opened (`unopened`). Of such a record nothing is read but its operating point and mean speed as
registered. The predictions are stored with their SHA-256; ``srbval report`` compares them with the records that are
registered.
"""

from argparse import Namespace
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

from srbval.bearing import DEFECTS, Fault
from srbval.comparison.compared_quantities import CAGE_RATIO
from srbval.comparison.effects import INPUTS
from srbval.comparison.speed_and_slip import published_rpm
from srbval.models.run import Run
from srbval.progress import Progress
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.recordings.registry import rig_recordings, unopened
from srbval.scene import SensorPath, draws, load_scene, merge, rig_inputs
from srbval.studies.harness import Study, StudyResult
from srbval.studies.predicted_rows import digest
from srbval.studies.rig_amplitudes import (
    FAST,
    FAULTS,
    FINER,
    NUMERICS,
    POWER,
    SLOW,
    SURFACES,
    half_widths,
    identified_paths,
    measured,
    of_waves,
    predicted,
    rig_inputs_read,
    rough_runs,
    run_of,
    values,
)

RIG_LOAD = load_scene("rig").load
RADIAL_KN, AXIAL_KN = (load_n / 1e3 for load_n in (RIG_LOAD.radial_n, RIG_LOAD.axial_n))
DIGITS = 6  # of the stored numbers


class OperatingPoint(NamedTuple):
    """A fault at a nominal speed of the motor and a mean speed of the shaft [rpm]."""

    state: Fault
    nominal_rpm: float
    shaft_rpm: float


def points() -> list[OperatingPoint]:
    """Those of the open records at 353 rpm, and of registered records that the project has never opened."""
    found = [OperatingPoint(state, SLOW, published_rpm(state, SLOW)[0]) for state in FAULTS]
    for entry in rig_recordings():
        at_load = (entry.radial_kn, entry.axial_kn or 0.0) == (RADIAL_KN, AXIAL_KN)
        if unopened(entry) and at_load and entry.state in DEFECTS and entry.nominal_rpm is not None:
            rpm = entry.rpm or published_rpm(entry.state, entry.nominal_rpm)[0]
            found.append(OperatingPoint(entry.state, entry.nominal_rpm, rpm))
    return found


def at_speed(record: Recording, point: OperatingPoint) -> Recording:
    """The record's samples under another name and speed: what `run_of` needs to know of a record to run the model."""
    speed = ShaftSpeed(value_hz=point.shaft_rpm / 60, ci95_hz=0.0, source=SpeedSource.STATED)
    name = f"{point.state.code} {point.nominal_rpm:g} rpm"
    return replace(record, name=name, state=point.state, speed=speed, speed_signal=None)


def prediction(
    point: OperatingPoint, runs: Sequence[Run], rough: Sequence[Run], at_rest: Sequence[Run],
    paths: Sequence[SensorPath], background: Recording,
) -> dict[str, Any]:  # fmt: skip
    """What the model says a record shows, and the parts of its uncertainty (95 %), each in the quantity's unit.

    `runs`: nominal, finer, draws, each with its path; `rough` and `at_rest` have waves, the latter is healthy.
    """
    model, parts = predicted(runs, point.state, paths, background)
    parts[SURFACES] = of_waves(rough, at_rest, point.state, paths[0])
    plain = values(model)
    if point.state is not Fault.ROLLER:
        nominal, finer, *drawn = (run.cage_ratio for run in runs)
        plain[CAGE_RATIO.name] = nominal
        parts[NUMERICS][CAGE_RATIO.name] = abs(finer - nominal)
        parts[INPUTS] |= half_widths([{CAGE_RATIO.name: one} for one in drawn])
    return {
        "state": point.state.value, "nominal_rpm": point.nominal_rpm, "radial_kn": RADIAL_KN, "axial_kn": AXIAL_KN,
        **_rounded({"shaft_rpm": point.shaft_rpm}), "values": _rounded(plain),
        "parts": {part: _rounded(of) for part, of in parts.items()},
    }  # fmt: skip


def predictions() -> Iterator[dict[str, Any]]:
    """One for each of `points`."""
    fast, slow, outer = measured(Fault.HEALTHY, FAST), measured(Fault.HEALTHY, SLOW), measured(Fault.OUTER, FAST)
    common = draws(rig_inputs(), POWER)
    positions = draws(rig_inputs("position"), POWER + len(points()).bit_length())
    changes = [
        [{}, FINER, *map(merge, common, positions[len(common) * i :])] for i in range(len(positions) // len(common))
    ]
    paths = list(identified_paths(outer, fast, [run_of(outer, Fault.OUTER, one) for one in changes[0]]))
    for point, own in zip(points(), changes[1:], strict=False):
        background = fast if abs(point.nominal_rpm - FAST) < abs(point.nominal_rpm - SLOW) else slow
        record = at_speed(background, point)
        runs = [run_of(record, point.state, one) for one in own]
        yield prediction(
            point, runs, rough_runs(record, point.state), rough_runs(record, Fault.HEALTHY), paths, background
        )


def _rounded(of: Mapping[str, float]) -> dict[str, float]:
    return {name: float(f"{value:.{DIGITS}g}") for name, value in of.items()}


def _run(_: Namespace, __: Progress) -> StudyResult:
    found = list(predictions())
    sha256 = digest(found)
    return StudyResult(
        name="predictions", content={"predictions": found, "predictions_sha256": sha256}, inputs=rig_inputs_read(),
        text=f"SHA-256 of {len(found)} predictions: {sha256}",
    )  # fmt: skip


STUDY = Study(question="What does the rig scene predict of rig records before they are compared?", minutes=10, run=_run)
