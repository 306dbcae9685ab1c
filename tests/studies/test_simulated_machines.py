"""Simulated machines: a fault at its place and level in a background, and nothing of a record with a fault."""

import bisect
import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from srbval.bearing import Fault, load_bearing
from srbval.diagnosis.fault_scores import fault_scores
from srbval.reading.analyse import analyse
from srbval.reading.pipeline import process
from srbval.recordings import ShaftSpeed, SpeedSource
from srbval.scene import paper_scene
from srbval.storage.installation import shipped_folder
from srbval.storage.json_files import read_json
from srbval.studies.known_records import KnownRecord
from srbval.studies.simulated_machines import study
from srbval.studies.simulated_machines.study import INPUTS, fault_signal, meets_races, part_of, with_added
from tests.reading.test_shaft_speed import BEARING, record

SHAFT_HZ = 25.0
SPEED = ShaftSpeed(value_hz=SHAFT_HZ, ci95_hz=1e-3, source=SpeedSource.TACHOMETER)
NOISE = dataclasses.replace(record(shaft_hz=SHAFT_HZ, fault=False), speed=SPEED, state=None)
WHOLE = analyse(NOISE, bearing=BEARING)
VALUE = {"extent": 0.02, "place": 0.0}
OF_HEALTHY = ("Normal", "H_", "N_", "2003.10.22")  # the shared records of healthy bearings


@pytest.mark.parametrize("state", [Fault.OUTER, Fault.INNER, Fault.ROLLER])
def test_a_fault_stands_at_its_own_order_at_the_level_asked_for(state: Fault) -> None:
    added = fault_signal(NOISE, BEARING, state, VALUE, np.random.default_rng(1))
    both = with_added(NOISE, added, 12.0)
    difference = both.channels["x"] - NOISE.channels["x"]
    assert 20 * math.log10(difference.std() / NOISE.channels["x"].std()) == pytest.approx(12.0, abs=1e-6)
    processed = process(both, band_hz=WHOLE.processed.band_hz)
    scores = fault_scores(dataclasses.replace(WHOLE, recording=both, processed=processed))
    best = max(scores.parts, key=lambda part: part.excess or 0.0)
    assert best.fault is state
    assert best.found_hz == pytest.approx(state.line_order(BEARING.orders) * SHAFT_HZ, rel=0.01)


def test_silence_stays_silence() -> None:
    np.testing.assert_array_equal(with_added(NOISE, np.zeros(NOISE.samples), 20.0).channels["x"], NOISE.channels["x"])


def test_a_ball_s_defect_meets_the_races_near_its_great_circle_alone() -> None:
    """The share that meets them is (contact's half width + half the defect) / radius: Archimedes; a roller's always."""

    def share(extent_m: float) -> float:
        defect = dataclasses.replace(ball.defect, extent_m=extent_m)
        scene = dataclasses.replace(ball, defect=defect)
        return bisect.bisect_left(range(1000), True, key=lambda n: not meets_races(scene, BEARING, n / 1000)) / 1000

    ball = paper_scene(bearing="skf-6205", model="impulse", defect={"kind": "roller", "extent_m": 4e-4})
    assert 0.05 < share(4e-4) < 0.5
    more = 5e-4 / (BEARING.elements.element_diameter_m / 2)
    assert share(1.4e-3) - share(4e-4) == pytest.approx(more, abs=3e-3)
    assert meets_races(ball, load_bearing("rexnord-za-2115"), 1.0)


def test_a_background_is_as_many_times_as_fast_as_asked() -> None:
    part = part_of(WHOLE, 2.0, 30.0, np.random.default_rng(0))
    assert part.speed.value_hz == pytest.approx(2 * WHOLE.speed.value_hz)
    assert part.seconds * part.speed.value_hz == pytest.approx(30.0, rel=1e-3)
    assert np.isin(part.channels["x"], NOISE.channels["x"]).all()


def test_a_machine_is_drawn_alike_every_time_and_scored_as_what_it_is_not_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study, "_read", lambda _: WHOLE)
    monkeypatch.setattr(study, "specimen", lambda _: "s")
    known = KnownRecord.__new__(KnownRecord)
    monkeypatch.setattr(study, "_one_of", lambda *_: known)
    monkeypatch.setattr(study, "features_of", lambda _, state, read: (state, fault_scores(read).features))
    found = [study.machine_features([known], 1, number) for number in range(4)]
    assert found[3] == study.machine_features([known], 1, 3) != found[2]
    for (own, _), *wrong in found:
        assert own in INPUTS["machine.state"].choices
        assert [state for state, _ in wrong] == ["other"] * (own != "healthy")


def test_no_record_of_a_faulty_bearing_was_read() -> None:
    stored = read_json(shipped_folder("reports") / "simulated_machines.json")
    assert stored["inputs_sha256"]
    assert all(any(word in Path(name).name for word in OF_HEALTHY) for name in stored["inputs_sha256"])
    assert {row[3] for row in stored["features"]} == {*INPUTS["machine.state"].choices, "other"}
