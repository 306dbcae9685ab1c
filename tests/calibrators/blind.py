"""Predictions of the rig's open records that nobody here has opened: ``python -m tests.calibrators.blind [-o FILE]``.

The rig scene with each fault at the published tachometer means of 353 rpm nominal, behind the path to the sensor that H
877 and OR 877 give, as `tests.calibrators.amplitudes` runs it: the inputs' ranges drawn together with where the hole
may lie, the path identified for each draw, waves on races and rollers as a further part. Of the slow records H 353
alone was seen; it is the background in which depth and kurtosis are read. What is stored is hashed, and ``srbval
report`` compares it once the records are registered.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from srbval.bearing import Fault
from srbval.cli.measured import this_machine
from srbval.models.run import Run
from srbval.recordings import Recording, ShaftSpeed, SpeedSource
from srbval.scene import SensorPath, draws, merge, rig_inputs
from srbval.storage.own_package import git_revision
from srbval.storage.stored_result import BLIND, COMMAND, stamped, store_result
from srbval.validation.amplitudes import NUMERICS, SURFACES, half_widths
from srbval.validation.blind import digest
from srbval.validation.compared_quantities import CAGE_RATIO
from srbval.validation.effects import INPUTS
from srbval.validation.speed_and_slip import published_speeds
from tests.calibrators.amplitudes import (
    FAST,
    FINER,
    POWER,
    SLOW,
    identified_paths,
    measured,
    of_waves,
    predicted,
    rough_runs,
    run_of,
    values,
)

STATES = (Fault.OUTER, Fault.INNER, Fault.ROLLER)
DIGITS = 6  # of the stored numbers


def placeholder(healthy: Recording, state: Fault) -> Recording:
    """A record's name, state, loads and published mean speed; its samples are the healthy one's and are not used."""
    rpm = next(one.mean_rpm for one in published_speeds().means if (one.state, one.nominal_rpm) == (state, SLOW))
    speed = ShaftSpeed(value_hz=rpm / 60, ci95_hz=0.0, source=SpeedSource.STATED)
    return replace(healthy, name=f"{state.code} {SLOW:g} rpm", state=state, speed=speed, speed_signal=None)


def prediction(
    wanted: Recording, runs: Sequence[Run], paths: Sequence[SensorPath], healthy: Recording, at_rest: Sequence[Run]
) -> dict[str, Any]:
    """What the model says a record shows, and the parts of its uncertainty (95 %), each in the quantity's unit.

    `at_rest` are the runs of the healthy bearing with waves.
    """
    assert wanted.state is not None
    assert wanted.speed is not None
    model, parts = predicted(runs, wanted.state, paths, healthy)
    parts[SURFACES] = of_waves(rough_runs(wanted, wanted.state), at_rest, wanted.state, paths[0])
    plain = values(model)
    if wanted.state is not Fault.ROLLER:
        nominal, finer, *drawn = (run.cage_ratio for run in runs)
        plain[CAGE_RATIO.name] = nominal
        parts[NUMERICS][CAGE_RATIO.name] = abs(finer - nominal)
        parts[INPUTS] |= half_widths([{CAGE_RATIO.name: one} for one in drawn])
    return {
        "state": wanted.state.value, "nominal_rpm": SLOW, "radial_kn": 124.8, "axial_kn": 0.0,
        "shaft_rpm": _rounded(60 * wanted.speed.value_hz), "values": _all_rounded(plain),
        "parts": {part: _all_rounded(of) for part, of in parts.items()},
    }  # fmt: skip


def predictions() -> Iterator[dict[str, Any]]:
    """One for each record."""
    fast, healthy = measured(Fault.HEALTHY, FAST), measured(Fault.HEALTHY, SLOW)
    outer = measured(Fault.OUTER, FAST)
    common, places = draws(rig_inputs(), POWER), draws(rig_inputs("position"), POWER + 2)
    changes = [[{}, FINER, *map(merge, common, places[i * len(common) :])] for i in range(len(STATES) + 1)]
    paths = list(identified_paths(outer, fast, [run_of(outer, Fault.OUTER, one) for one in changes[0]]))
    at_rest = rough_runs(healthy, Fault.HEALTHY)
    for state, own in zip(STATES, changes[1:], strict=True):
        wanted = placeholder(healthy, state)
        yield prediction(wanted, [run_of(wanted, state, one) for one in own], paths, healthy, at_rest)


def _all_rounded(of: Mapping[str, float]) -> dict[str, float]:
    return {name: _rounded(value) for name, value in of.items()}


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def main() -> None:
    """Predict, print the hash and store."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("-o", "--output", type=Path)
    options = parser.parse_args()
    revision, found = git_revision(), list(predictions())
    content = {"machine": this_machine(), "predictions": found, "predictions_sha256": digest(found)}
    print(f"SHA-256 of the predictions: {content['predictions_sha256']}")
    path = store_result(stamped(BLIND, content, command=COMMAND[BLIND], revision=revision), options.output)
    print(f"stored: {path}")


if __name__ == "__main__":
    main()
