"""Regression against `reports/reference.toml`: every quantity within its tolerance."""

from __future__ import annotations

import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

import srbval

REFERENCE = Path(__file__).parents[1] / "reports" / "reference.toml"
QUANTITIES = {q["name"]: q for q in tomllib.loads(REFERENCE.read_text(encoding="utf-8"))["quantity"]}
RIG_FILES = {"rig_outer_order": "torino/OR_877rpm_sample.mat", "rig_inner_order": "torino/IR_877rpm_sample.mat"}


@pytest.fixture(scope="module")
def runs() -> dict[str, srbval.Run]:
    return {k: srbval.simulate(srbval.paper_scene(duration="2 s", defect={"kind": k})) for k in ("outer", "inner")}


SIMULATED: dict[str, Callable[[dict[str, srbval.Run]], float]] = {
    "cage_ratio_outer": lambda runs: runs["outer"].cage_ratio,
    "cage_ratio_inner": lambda runs: runs["inner"].cage_ratio,
    "roller_load_share_outer": lambda runs: runs["outer"].roller_load_share,
    "ring_displacement_um": lambda runs: float(runs["outer"].displacement_m[:, 1].mean()) * 1e6,
    "read_bpfo_hz": lambda runs: _line(srbval.recording_from_run(runs["outer"]), "BPFO"),
}


def _line(recording: srbval.Recording, name: str) -> float:
    found = srbval.analyse(recording, bearing=srbval.load_bearing("skf-22240")).line(name).found_hz
    assert found is not None
    return float(found)


def test_every_quantity_is_computed() -> None:
    assert set(QUANTITIES) == set(SIMULATED) | set(RIG_FILES)


@pytest.mark.parametrize("name", SIMULATED)
def test_simulated(name: str, runs: dict[str, srbval.Run]) -> None:
    wanted = QUANTITIES[name]
    assert SIMULATED[name](runs) == pytest.approx(wanted["value"], abs=wanted["tolerance"]), wanted["reason"]


@pytest.mark.recordings
@pytest.mark.parametrize("name", RIG_FILES)
def test_measured(name: str, recordings_dir: Path) -> None:
    recording = srbval.load_recording(recordings_dir / RIG_FILES[name])
    assert recording.speed is not None
    assert recording.speed.source is srbval.SpeedSource.TACHOMETER
    order = _line(recording, "BPFO" if "outer" in name else "BPFI") / recording.speed.value_hz
    wanted = QUANTITIES[name]
    assert order == pytest.approx(wanted["value"], abs=wanted["tolerance"]), wanted["reason"]
