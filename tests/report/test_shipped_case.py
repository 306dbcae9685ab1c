"""The shipped case: every registered record of the rig is a pair, and its rows are those of the report."""

import dataclasses
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from srbval import Analysis, NumericsError, Origin, SpeedSource, Validation, analyse
from srbval.bearing import Fault, load_bearing
from srbval.comparison.bias import biases
from srbval.comparison.compared_quantities import CAGE_RATIO, HARMONIC, PRESENCE, values_of_model
from srbval.comparison.counterpart import AnalysedRun
from srbval.recordings.registry import add
from srbval.report.findings.rows import compared
from srbval.validation import sides, validate
from tests.recordings import files
from tests.recordings.synthetic_record import vibration

LINE_PCT = 0.06  # the interval of a line read from two seconds of the impulse model

BEARING = load_bearing("skf-22240")
FS_HZ, SECONDS, RPM = 20480.0, 2.0, 858.0
CAGE = 0.432
CODES = {"H": Fault.HEALTHY, "OR": Fault.OUTER, "IR": Fault.INNER}


def rig_file(folder: Path, code: str, rpm: float = 877, shaft_rpm: float = RPM) -> None:
    """A file in the excerpts' layout, its signal made by the impulse model for this test."""
    count = int(FS_HZ * SECONDS)
    turns = np.arange(count) * shaft_rpm / 60 / FS_HZ
    signal = vibration(CODES[code], BEARING.orders, turns, np.random.default_rng(len(code)))
    changes = {"acc_m_s2": signal, "time_acc": np.arange(count) / FS_HZ, "condition": code, "rpm_nominal": rpm}
    changes["rpm"] = np.full(count, shaft_rpm)
    files.excerpt(folder / f"{code}_{rpm:g}rpm_made.mat", **changes)


def another_impulse_model(rig: Analysis, *_: Any, **__: Any) -> AnalysedRun:
    """A stand-in for the model's run: the impulse model once more, other noise, the cage a little too fast."""
    recording = rig.recording
    state = recording.state or Fault.HEALTHY
    turns = np.arange(int(FS_HZ * SECONDS)) * rig.speed.value_hz / FS_HZ
    orders = dataclasses.replace(BEARING.orders, bpfo=19 * CAGE, bpfi=19 * (1 - CAGE))
    made = dataclasses.replace(
        recording,
        origin=Origin.SIMULATED,
        band_hz=recording.band_hz,
        channels={"x": vibration(state, orders, turns, np.random.default_rng(99))},
        channel="x",
    )
    order = {Fault.OUTER: 19 * CAGE, Fault.INNER: 19 * (1 - CAGE)}.get(state)
    analysis = analyse(made, bearing=BEARING, speed=rig.speed)
    values = values_of_model(analysis, state, order, sides.QUANTITIES)
    run = SimpleNamespace(cage_ratio=CAGE)
    return AnalysedRun(case=None, run=run, analysis=analysis, line_order=order, values=values)


def known(defect: str, line: str) -> dict[tuple[str, str], dict[str, float]]:
    sizes = {"cage ratio": 0.0004, f"2x{line}": 1.0, f"{line} sidebands": 1.0}
    return {(defect, name): {"shift": 0.0, "inputs_ci95": size, "grid_ci95": 0.0} for name, size in sizes.items()}


KNOWN = known("outer", "BPFO") | known("inner", "BPFI")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("rig")
    for code in CODES:
        rig_file(folder, code)
    return folder


def made(folder: Path, counterpart: Any = another_impulse_model, effects: Any = KNOWN) -> Validation:
    add(folder)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(validate, "effects_of", lambda _: effects)
        patch.setattr(sides, "run_counterpart", counterpart)
        return validate.validate("torino-22240", jobs=2)


@pytest.fixture(scope="module")
def found(folder, tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("SRBVAL_HOME", str(tmp_path_factory.mktemp("home")))
        patch.delenv("SRBVAL_RECORDINGS", raising=False)
        return made(folder)


def cage_of(result: Validation, state: Fault) -> Any:
    frame = compared(result.comparisons)
    return frame[(frame["state"] == state.value) & (frame["kind"] == CAGE_RATIO.kind)].iloc[0]


def kinds_of(result: Validation, code: str, rpm: float) -> set[str]:
    frame = compared(result.comparisons)
    return set(frame[frame["record"].str.endswith(f"{code}_{rpm:g}rpm_made.mat")]["kind"])


def test_a_record_is_compared_at_its_own_speed(found):
    assert [pair["state"] for pair in found.pairs.to_dict("records")] == ["healthy", "inner", "outer"]
    facts = found.pairs["measured_facts"].iloc[1]
    assert facts["shaft_from"] == SpeedSource.TACHOMETER.value
    outer, inner = (cage_of(found, state) for state in (Fault.OUTER, Fault.INNER))
    assert (outer["model"], inner["model"]) == (pytest.approx(CAGE), pytest.approx(CAGE))
    assert inner["error"] == pytest.approx(100 * (CAGE / inner["rig"] - 1))  # not of the line, whose sign is the other
    assert outer["uncertainty"] > 0.09  # the known term's


def test_a_registered_record_is_a_comparison_of_every_quantity(found, folder, tmp_path):
    """Nothing but files that are registered: each adds its record, and its rows to every kind of quantity."""
    add(folder)
    for code in ("H", "IR", "OR"):
        rig_file(tmp_path, code, rpm=727, shaft_rpm=709.0)
    after = made(tmp_path)
    levels = {row.kind for row in HARMONIC.values()}
    assert {CAGE_RATIO.kind, HARMONIC[2].kind, PRESENCE.kind} <= kinds_of(after, "IR", 727.0)
    assert {CAGE_RATIO.kind, HARMONIC[2].kind} <= kinds_of(after, "OR", 727.0) <= {CAGE_RATIO.kind, *levels}
    assert kinds_of(after, "H", 727.0) == set()
    counted = [
        {b["kind"]: b["records"] for b in biases(compared(one.comparisons), used_for="withheld")}
        for one in (found, after)
    ]
    for row in (CAGE_RATIO, HARMONIC[2]):  # higher harmonics need not show on both sides
        assert (counted[0][row.kind], counted[1][row.kind]) == (2, 4)


def test_bias_is_the_planted_one(found):
    """Both sides are the same impulse model but for the cage: that is the bias, and sidebands show on both."""
    planted = 100 * (19 * CAGE / BEARING.orders.bpfo - 1)
    for state in (Fault.OUTER, Fault.INNER):
        assert cage_of(found, state)["error"] == pytest.approx(planted, abs=LINE_PCT)
        assert cage_of(found, state)["verdict"] == "differs"  # the planted 0.3 % is far beyond what is not known
    frame = compared(found.comparisons)
    shown = frame[frame["kind"] == PRESENCE.kind]
    assert shown[["model", "rig"]].to_numpy().tolist() == [[1.0, 1.0]]


def test_a_healthy_record_costs_no_run_and_a_failed_run_leaves_the_record(folder):
    asked = []

    def counterpart(rig: Analysis, *_: Any, **__: Any) -> AnalysedRun:
        asked.append(rig.recording.state)
        raise NumericsError("the load was lost")

    failed = made(folder, counterpart)
    assert sorted(asked) == [Fault.INNER, Fault.OUTER]
    assert list(failed.pairs["problem"]) == ["", "the load was lost", "the load was lost"]
    assert compared(failed.comparisons).empty
    assert set(failed.table["verdict"]) == {"insufficient data"}
