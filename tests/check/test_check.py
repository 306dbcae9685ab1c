"""The check compares the behaviour of now with its reference, and names the evidence that no longer holds."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from srbval import ConfigurationError, Scene, load_scene
from srbval.check import check, fingerprint
from srbval.check.check import differences, run_check, write_reference
from srbval.models.full import parameters
from srbval.models.full.point_cloud import Circle
from srbval.storage.behaviour import Fingerprint, reference_fingerprint

TEN_MICROMETRES = 1e-5
NOW: Fingerprint = {
    "full": {"outer: cage_ratio": 0.43, "outer: status": "ok"}, "reading": {"H: hz": 97.0, "H: snr": math.nan},
}  # fmt: skip


@pytest.fixture(autouse=True)
def forget_recordings():
    yield
    reference_fingerprint.cache_clear()


def failed(*parts: str) -> set[str]:
    return {one.name for one in run_check(*parts).checks if not one.ok}


def off(changes: dict[str, Any]) -> Callable[..., Scene]:
    def made(base: str, given: dict[str, Any]) -> Scene:
        scene = load_scene(base, given)
        return replace(scene, contact=replace(scene.contact, **changes))

    return made


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{"stiffness_n_m": 5e7 * (1 + 1e-4)}, {"dynamic_friction": 0.5 * (1 + 1e-4)}])
def test_an_input_off_by_a_tenth_of_a_per_mille_is_noticed(changes, monkeypatch):
    monkeypatch.setattr(fingerprint, "load_scene", off(changes))
    found = failed("full")
    assert {"full: paper printed outer: cage_ratio", "full: paper printed outer: drive_power_w"} & found


@pytest.mark.slow
@pytest.mark.parametrize("race", ["outer_circle", pytest.param("inner_circle", marks=pytest.mark.long_form)])
def test_a_circle_ten_micrometres_off_is_noticed(race, monkeypatch):
    as_it_is: Callable[..., Circle] = getattr(parameters, race)

    def moved(geometry: object, at: float) -> Circle:
        circle = as_it_is(geometry, at)
        return circle._replace(radius_m=circle.radius_m + TEN_MICROMETRES) if at == 1.0 else circle

    monkeypatch.setattr(parameters, race, moved)
    assert failed("full")


def test_numbers_words_and_missing_quantities(monkeypatch):
    monkeypatch.setattr(check, "fingerprint", lambda *_, **__: NOW)
    monkeypatch.setattr(check, "shipped_results", list)
    assert run_check(reference=NOW).ok
    other = {"full": {"outer: cage_ratio": 0.4301, "outer: status": "skidding"}, "reading": {"gone: hz": 1.0}}
    found = {one.name: one for one in run_check(reference=other).checks}
    assert not any(one.ok for one in found.values())
    assert found["full: outer: cage_ratio"].low < 0.4301 < found["full: outer: cage_ratio"].high < 0.43011
    assert found["full: outer: status"].words == ("skidding", "ok")
    assert math.isnan(found["reading: gone: hz"].value)
    assert math.isnan(found["reading: H: hz"].low)
    assert [one["name"] for one in differences(other, NOW)][:2] == ["full: outer: cage_ratio", "full: outer: status"]


def test_no_reference_is_made_of_a_failure(tmp_path, monkeypatch):
    monkeypatch.setattr(check, "shipped_folder", lambda _: tmp_path)
    with pytest.raises(ConfigurationError, match="nothing was replaced"):
        write_reference({"full": {"outer: cage_ratio": math.nan}})
    assert not list(tmp_path.iterdir())
    write_reference(NOW)
    monkeypatch.setattr("srbval.storage.behaviour.shipped_folder", lambda _: tmp_path)
    assert differences(reference_fingerprint(), NOW) == []
