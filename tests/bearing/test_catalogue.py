from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from srbval.bearing import find_bearings, known_bearings, load_bearing
from srbval.errors import ConfigurationError, DataError

GAP_M = 2e-5  # what Table 1's rounding leaves of the gap between the raceways

GEOMETRY = """
title = "test"
source = "test"
[geometry]
raceway_radius = "164 mm"
tilt = "10 deg"
pitch_radius = "141.81 mm"
roller_width = "37 mm"
roller_diameter = "40.1 mm"
inner_centre_radial = "283.61 mm"
inner_centre_axial = "50.01 mm"
rollers_per_row = 19
outer_diameter = "360 mm"
width = "98 mm"
"""


def test_names_of_the_interface_are_there() -> None:
    assert {"skf-22240", "skf-6205", "skf-6203", "mfpt-nice", "fag-22205"} <= set(known_bearings())


def test_a_file_of_the_same_content_is_the_same_bearing(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(GEOMETRY)
    mine, known = load_bearing(path), load_bearing("skf-22240")
    assert (mine.orders, mine.geometry, mine.name) == (known.orders, known.geometry, "mine")


def test_unknown_name_gets_the_nearest() -> None:
    with pytest.raises(ConfigurationError, match="Did you mean 'skf-22240'"):
        load_bearing("skf22240")


def test_missing_file_is_missing_data() -> None:
    with pytest.raises(DataError, match="no such file"):
        load_bearing("nowhere.toml")


def test_two_tables_are_one_too_many(tmp_path: Path) -> None:
    path = tmp_path / "two.toml"
    path.write_text(GEOMETRY + "[orders]\nrolling_elements = 9\nbpfo = 3.6\nbpfi = 5.4\nbsf = 1.0\nftf = 0.4\n")
    with pytest.raises(ConfigurationError, match="exactly one"):
        load_bearing(path)


def test_touching_diameter_closes_the_gap() -> None:
    geometry = load_bearing("skf-22240").geometry
    assert geometry is not None
    # outer gap: sphere about the origin; inner gap: arc about its centre, both seen from the roller's centre
    assert geometry.zero_play_diameter_m == pytest.approx(2 * 0.020, abs=GAP_M)
    assert geometry.zero_play_diameter_m < geometry.roller_diameter_m


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rollers_per_row": 30}, "overlap"),
        ({"roller_width_m": 0.02}, "too short"),
        ({"pitch_radius_m": -1.0}, "positive"),
        ({"rollers_per_row": 0}, "positive"),
        ({"raceway_radius_m": 0.14}, "must lie between"),
        ({"raceway_radius_m": 0.19}, "must lie between"),
        ({"inner_centre_radial_m": 0.25}, "leave a gap of .* = 0.28362, inner_centre_axial_m = 0.0500"),
        ({"roller_diameter_m": 0.03}, "leave a gap of"),
    ],
)
def test_impossible_geometry_is_refused(change: dict[str, float], message: str) -> None:
    geometry = load_bearing("skf-22240").geometry
    assert geometry is not None
    with pytest.raises(ConfigurationError, match=message):
        replace(geometry, **change)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("[orders]\nrolling_elements = 15\nbpfo = 6.2\nbpfi = 12.3\nbsf = 2.7\nftf = 0.41", "must be the number"),
        ("[orders]\nrolling_elements = 0\nbpfo = 6.2\nbpfi = 8.8\nbsf = 2.7\nftf = 0.41", "must be the number"),
        ("[orders]\nrolling_elements = 15\nbpfo = 6.2\nbpfi = 8.8\nbsf = 2.7\nftf = 41.0", "ftf = 41.0 must lie"),
        ("[orders]\nrolling_elements = 15\nbpfo = 6.2", "missing key"),
        ("[elements]\nrolling_elements = -9\nelement_diameter = '8 mm'\npitch_diameter = '39 mm'\n"
         "contact_angle = '0 deg'", "rolling_elements = -9 must be 1 or more"),
        ("[elements]\nrolling_elements = 9\nelement_diameter = '0 mm'\npitch_diameter = '39 mm'\n"
         "contact_angle = '0 deg'", "must be positive"),
        ("[elements]\nrolling_elements = 9\nelement_diameter = 8\npitch_diameter = '39 mm'\n"
         "contact_angle = '0 deg'", "has no unit"),
        ("[elements]\nrolling_elements = 9\nelement_diametre = '8 mm'", "did you mean"),
        ("", "exactly one"),
        ("[elements", "not a valid TOML file"),
    ],
)  # fmt: skip
def test_a_bad_file_is_wrong_use(table: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    path.write_text(f"title = 'mine'\nsource = 'a drawing'\n{table}\n")
    with pytest.raises(ConfigurationError, match=message):
        load_bearing(path)


SUM = 2e-3  # of the number of elements: multipliers printed with three digits
CAGE = 1.3e-2  # of the cage's order: 0.40 is printed with two digits
STEEPEST = 0.7  # cosine of the contact angle that the orders imply, 45 degrees


@pytest.mark.parametrize("name", known_bearings())
def test_the_orders_of_every_known_bearing_fit_each_other(name: str) -> None:
    """What pure rolling makes of published numbers: an entry that was made up fails here."""
    bearing = load_bearing(name)
    orders, count = bearing.orders, bearing.rolling_elements
    assert orders.bpfo + orders.bpfi == pytest.approx(count, rel=SUM)
    assert orders.ftf * count == pytest.approx(orders.bpfo, rel=CAGE)
    ratio = 1 - 2 * orders.bpfo / count
    cosine = orders.bsf * 2 * ratio / (1 - ratio**2)  # bsf = D / (2 d) (1 - ratio^2), ratio = d cos / D
    assert STEEPEST < cosine < 1 + CAGE
    assert len(bearing.source) > 20


def test_a_search_looks_at_every_word() -> None:
    assert {b.name for b in find_bearings("222")} == {"skf-22240", "fag-22205", "skf-22228"}
    assert [b.name for b in find_bearings("SKF deep cwru fan")] == ["skf-6203"]
    assert find_bearings("no such bearing") == ()
    assert len(find_bearings("")) == len(known_bearings())


def test_a_published_list_of_orders_agrees_with_the_dimensions() -> None:
    """MAFAULDA prints both: 2.998, 5.002, 1.871, 0.375."""
    orders = load_bearing("mafaulda-ball").orders
    assert (orders.bpfo, orders.bpfi, orders.bsf, orders.ftf) == pytest.approx((2.998, 5.002, 1.871, 0.375), abs=1e-3)


def test_published_orders_of_one_bearing_agree_with_one_another() -> None:
    """Both race orders and the cage's say the same ratio of diameters as the element's own; within their digits."""
    checked = [b for b in find_bearings("timken") if b.elements is None]
    assert len(checked) >= 29
    for bearing in checked:
        orders, count = bearing.orders, bearing.rolling_elements
        ratio = 1 - 2 * orders.bpfo / count
        assert orders.bpfo + orders.bpfi == pytest.approx(count, abs=0.0015), bearing.name
        assert orders.ftf * count == pytest.approx(orders.bpfo, abs=6e-4 * count), bearing.name
        assert orders.bsf == pytest.approx((1 / ratio - ratio) / 2, abs=2e-3), bearing.name
