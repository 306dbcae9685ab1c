"""Passages of a hole, and pockets that differ: planted places are found, and a swing is told from them."""

import numpy as np
import pytest

from srbval.bearing import load_bearing
from srbval.cli import main
from srbval.models.full.parameters import slot_angles
from srbval.scene import load_scene, paper_scene
from srbval.studies.cage_pockets.study import SLOTS, passages, repeats

PER_PASSAGE, TURNS = 223.7, 6
NUMBER = np.arange(TURNS * SLOTS)
SLOT_PLACES = np.random.default_rng(3).uniform(-0.01, 0.01, SLOTS)
FOUND = 5e-4  # of a passage: two steps of the lags


def planted(places: np.ndarray) -> np.ndarray:
    """Squared envelope of pulses at these places."""
    at = np.arange(int((len(places) + 1) * PER_PASSAGE))[:, None] / PER_PASSAGE
    pulses: np.ndarray = np.exp(-(((at - 0.5 - NUMBER - places) / 0.04) ** 2)).sum(axis=1)
    return pulses


def test_places_of_slots_are_found_and_told_from_a_swing() -> None:
    swing = 0.008 * np.sin(2 * np.pi * NUMBER / SLOTS + 0.7)
    for places, of_slots in ((np.tile(SLOT_PLACES, TURNS), True), (swing, False)):
        lag, coherence = passages(planted(places), PER_PASSAGE)
        assert lag[: NUMBER.size] - places - np.mean(lag - places) == pytest.approx(0.0, abs=6 * FOUND)
        found = repeats(lag[: NUMBER.size])
        assert found["next_turn"] > 0.95
        assert (found["next_slot"] < 0.5) is of_slots
        assert (found["slots_sd"] > 5 * FOUND) is of_slots
        assert coherence[0] > coherence[-1]


def test_slots_stand_evenly_but_for_their_pockets() -> None:
    geometry = load_bearing("skf-22240").geometry
    even = slot_angles(load_scene("rig"), geometry)
    assert np.diff(even[:SLOTS]) == pytest.approx(2 * np.pi / SLOTS)
    moved = [
        (slot_angles(load_scene("rig", {"seed": seed, "bodies": {"pocket_offset": "0.3 mm"}}), geometry) - even)
        * geometry.pitch_radius_m
        for seed in (1, 2)
    ]
    assert all(2e-4 < np.abs(one).max() <= 3e-4 * (1 + 1e-9) for one in moved)
    assert not np.allclose(*moved)
    assert paper_scene().bodies.pocket_offset_m == 0


@pytest.mark.parametrize("value", ["3 mm", "-1 um", "1 N"])
def test_an_impossible_offset_is_a_wrong_scene(value: str, tmp_path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(f'[bodies]\npocket_offset = "{value}"\n', encoding="utf-8")
    assert main(["simulate", str(path)]) == 2
    assert "pocket_offset" in capsys.readouterr().err
