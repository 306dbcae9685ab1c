"""Known bearings, bearings from files and numbers, and their fault frequencies."""

from dataclasses import replace

import pytest

from srbval import ConfigurationError, fault_frequencies, find_bearings, known_bearings, load_bearing
from srbval.bearing.designations import read_designation, read_table

GEOMETRY = """
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


def test_a_file_of_the_same_content_is_the_same_bearing(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("title = 'mine'\n" + GEOMETRY)
    mine, known = load_bearing(path), load_bearing("skf-22240")
    assert (mine.orders, mine.geometry, mine.name) == (known.orders, known.geometry, "mine")
    assert mine.source == "mine.toml", "a file that names no source is its own"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"rollers_per_row": 30}, "overlap"),
        ({"roller_width_m": 0.02}, "too short"),
        ({"rollers_per_row": 0}, "rollers_per_row = 0 must be at least 1"),
        ({"raceway_radius_m": 0.19}, "must be between"),
        ({"inner_centre_radial_m": 0.25}, "gap between the raceways .* = 0.28362, inner_centre_axial_m = 0.0500"),
    ],
)
def test_impossible_geometry_is_refused(change, message):
    geometry = load_bearing("skf-22240").geometry
    with pytest.raises(ConfigurationError, match=message):
        replace(geometry, **change)


def table(name: str, **values: object) -> str:
    """Write a table of a bearing file: strings quoted, numbers unchanged."""
    return f"[{name}]\n" + "".join(f"{key} = {value!r}\n" for key, value in values.items())


ORDERS_OF_9 = {"rolling_elements": 9, "bpfo": 3.6, "bpfi": 5.4, "bsf": 1.0, "ftf": 0.4}
ELEMENTS = {"rolling_elements": 9, "element_diameter": "8 mm", "pitch_diameter": "39 mm", "contact_angle": "0 deg"}
BAD = [
    (table("orders", **ORDERS_OF_9 | {"bpfi": 12.3}), "must be the number"),
    (table("elements", **ELEMENTS | {"rolling_elements": -9}), "rolling_elements = -9 must be at least 1"),
    (table("elements", **ELEMENTS | {"element_diameter": "0 mm"}), "must be above 0"),
    (table("elements", **ELEMENTS | {"element_diameter": "nan mm"}), "element_diameter"),
    (table("elements", **ELEMENTS | {"element_diameter": "39 mm"}), "between 0 and 1"),
    ("", "exactly one"),
    (GEOMETRY + table("orders", **ORDERS_OF_9), "exactly one"),
    ("[elements", "not a valid TOML file"),
]


@pytest.mark.parametrize(("text", "message"), BAD)
def test_a_bad_file_is_wrong_use(text, message, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(f"title = 'mine'\nsource = 'a drawing'\n{text}\n")
    with pytest.raises(ConfigurationError, match=message):
        load_bearing(path)


STEEPEST, FLATTEST = 0.7, 1.013  # cosine of the contact angle that the orders imply: 45 degrees; two digits of a BSF
ORDERS = ("bpfo", "bpfi", "bsf", "ftf")
PRINTED = tuple(read_table("catalogue.csv"))
DOUBLED = 2.5e-4  # NTN-SNR print twice the BSF, with three digits
UNNAMED_ANGLE = {"upm-citef", "vibroguard", "mb"}  # spherical rollers, and multipliers that were rounded before


def test_printed_orders_fit_each_other_and_the_dimensions():
    """Printed orders satisfy the equations of pure rolling within their digits; invented orders would fail."""
    rows = [row for row in PRINTED if row["bpfo"]]
    assert len(rows) >= 400
    for row in rows:
        count, name, texts = int(row["rolling_elements"]), row["name"], [row[k] for k in ORDERS]
        bpfo, bpfi, bsf, ftf = printed = [float(text) for text in texts]
        outer, inner, spin, cage = half = [0.5001 * 10 ** -len(text.partition(".")[2]) for text in texts]
        half[2] = spin = max(spin, DOUBLED)
        assert bpfo + bpfi == pytest.approx(count, abs=outer + inner), name
        assert ftf == pytest.approx(bpfo / count, abs=cage + outer / count), name
        ratio = 1 - 2 * bpfo / count
        spin += (1 + ratio**-2) * outer / count
        assert row["source"] in UNNAMED_ANGLE or bsf == pytest.approx((1 / ratio - ratio) / 2, abs=spin), name
        if row["element_diameter"]:
            own = vars(load_bearing(name).orders).values()
            assert all(abs(a - b) <= c for a, b, c in zip(printed, own, half, strict=True)), name


def test_every_known_bearing_gives_fault_frequencies():
    """Each row has its source, a possible number of elements, and a possible contact angle."""
    assert {row["key"] for row in read_table("catalogue_sources.csv")} == {row["source"] for row in PRINTED}
    assert len({row["name"] for row in PRINTED}) == len(PRINTED)
    for name in known_bearings():
        bearing, lines = load_bearing(name), fault_frequencies(name, rpm=600)
        count, ratio = bearing.rolling_elements, 1 - 2 * lines.bpfo_hz / bearing.rolling_elements / 10
        assert lines.bpfo_hz + lines.bpfi_hz == pytest.approx(10 * count, rel=2e-3), name
        assert STEEPEST < lines.bsf_hz / 10 * 2 * ratio / (1 - ratio**2) < FLATTEST, name


def test_a_search_looks_at_every_word():
    assert {"skf-22240", "fag-22205", "skf-22228", "ntn-nu222e"} <= {b.name for b in find_bearings("222")}
    assert {b.name for b in find_bearings("spherical 222")} == {"skf-22240", "fag-22205", "skf-22228"}
    assert [b.name for b in find_bearings("SKF deep cwru fan")] == ["skf-6203"]
    assert find_bearings("no such bearing") == ()
    assert len(find_bearings("")) == len(known_bearings())


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("elements 38,40.1,283.62,10", "count one row"),
        ("elements 19.5,40.1,283.62,10", "must be whole"),
        ("elements 9,4.1,283.62,10", "at least 25%"),
        ("elements 19;40.1;283.62;10", "4 numbers with commas"),
        ("orders 8.2,10.8,3.5,0.5", "between 0 and 1, within .* bpfo divided by"),
        ("orders 3.585,5.415,4.713,0.398", r"bsf = 4.713 is impossible .* 2.357 times .* BSF is half of it"),
        ("orders 3.585,5.415,7.2,0.398", "is impossible with .* bpfi must be above bpfo"),
        ("22230", "is not known.*'s dimensions with bearing=.* or its orders with bearing="),
    ],
)
def test_numbers_in_place_of_a_name_must_be_a_bearing(text, said):
    with pytest.raises(ConfigurationError, match=said):
        load_bearing(text)


def test_numbers_in_place_of_a_name_are_that_bearing():
    known = load_bearing("skf-22240").orders
    assert vars(load_bearing("elements 19,40.1,283.62,10").orders) == pytest.approx(vars(known), rel=1e-12)
    assert load_bearing("orders 8.177,10.823,3.468,0.4304").rolling_elements == 19


PRINTED_NAMES = {  # by number, diameter and pitch [mm] of one row: balls on the mid-diameter of the rings
    (9, 7.94, 39.04): ["6205", "6205-2RS", "62052RS", "SKF 6205-2RSH/C3", "skf6205 zz"],
    (9, 7.9, 38.5): ["NSK 6205 DDU C3"],
    (8, 6.747, 28.5): ["6203-2Z/C3", "NTN 6203LLU", "SS6203"],
    (8, 7.938, 33.5): ["KOYO 6204 ZZ", "6204-2RS1", "UC 204", "UCP204"],
    (9, 9.525, 46): ["6206", "NACHI 6206-2NSE", "UCF 206"],
    (9, 11.112, 53.5): ["FAG 6207-C-2HRS"],
    (10, 15.875, 85): ["6212/C3"],
    (9, 6.35, 31): ["6004-2RSH"],
    (11, 7.144, 42.5): ["6006"],
    (7, 8.731, 32): ["6303 2RS"],
    (7, 3.96, 15): ["SKF 608-2Z"],
    (7, 9.525, 36): ["6304-ZZ"],
    (8, 17.462, 72.5): ["6309", "SKF 6309-2Z/C3VL0241"],
    (8, 19.05, 80): ["6310 M/C3"],
    (8, 22.225, 95): ["6312"],
    (8, 25.4, 110): ["6314 M C3"],
    (13, 9, 46.5): ["NU206", "NU 206 ECP", "FAG NU206-E-XL-TVP2", "NJ 206 E", "NUP 206 ECJ"],
    (13, 7.5, 39): ["NU-205-E-TVP2"],
    (8, 7.92, 34.55): ["UER204", "LDK UER 204"],
    (15, 6.2 * 0.9759, 35.8): ["30204"],
    (19, 40.1 * 0.9848, 283.62): ["SKF 22240 CCK/W33", "22240 CC/W33"],
}
UNKNOWN_NAMES = {  # with the nearest of the same size
    "7206B": "timken-206k",
    "SKF 7206 BEP": "timken-206k",
    "7312 BECBM": "timken-312k",
    "SKF 6205 ETN9": "skf-6205",
    "6308-2RS": "timken-308k",
    "6305": "ntn-nu305e",
    "FAG 22240 B": "skf-22240",
    "HK 1210": None,
    "6025": None,
}
MAKERS = 0.005  # by which the orders of makers differ
PRINTED_NAME = [(text, of) for of, texts in PRINTED_NAMES.items() for text in texts]


def test_printed_designations_have_the_orders_of_their_size_or_are_not_known():
    assert len(PRINTED_NAME) + len(UNKNOWN_NAMES) >= 40
    for text, (count, diameter, pitch) in PRINTED_NAME:
        bearing, half = load_bearing(text), count / 2
        expected = half * (1 - diameter / pitch), half * (1 + diameter / pitch)
        assert (bearing.orders.bpfo, bearing.orders.bpfi) == pytest.approx(expected, rel=MAKERS), text
        assert bearing.title.startswith(f"{text}, taken as "), text
        assert bearing.name in {one.name for one in find_bearings(f" {text.lower()} ")}, text
    assert [load_bearing(text).name for text in ("22205E1KC3", "SKF 1205")] == ["fag-22205", "skf-1205"]
    for text, near in UNKNOWN_NAMES.items():
        with pytest.raises(ConfigurationError, match="is not known") as refused:
            load_bearing(text)
        said = str(refused.value).partition("(orders may differ): ")[2].partition(". `")[0]
        assert said.split(", ")[0] == (near or ""), text
        size = read_designation(text).size
        own = {name: load_bearing(name).title for name in said.split(", ") if name}
        assert all(size in title for title in own.values()), text


@pytest.mark.parametrize(("name", "rating_kn"), [("SKF 6205-2Z", 7.8), ("NU 206 ECP", 36.5), ("skf-22240", 1930.0)])
def test_a_load_beyond_the_static_rating_is_a_caution(name, rating_kn):
    bearing = load_bearing(name)
    assert bearing.overload(0.99e3 * rating_kn, None) == bearing.overload(None, 0.0) == ""
    assert f"static load rating of the bearing, {rating_kn:.4g} kN" in bearing.overload(1.01e3 * rating_kn, 1.0)
    assert load_bearing("mfpt-nice").overload(1e9, None) == ""


PUBLISHED_ORDER = 3e-4  # published with four decimals, from diameters rounded to a tenth of a thousandth of an inch


@pytest.mark.parametrize(
    ("name", "bpfi", "bpfo", "twice_bsf", "ftf"),
    [  # Case Western Reserve University's table of fault frequencies; MFPT's description
        ("skf-6205", 5.4152, 3.5848, 4.7135, 0.39828),
        ("skf-6203", 4.9469, 3.0530, 3.9874, 0.3817),
        ("mfpt-nice", 4.755, 3.245, 5.1091, 0.4056),
        ("fag-22205", 8.8148, 6.1852, 5.4030, 0.4123),
        ("rexnord-za-2115", 8.907, 7.092, 8.394, 0.444),  # at 2000 rpm, as printed with its dimensions
        ("mafaulda-ball", 5.002, 2.998, 2 * 1.871, 0.375),  # with three decimals, beside its dimensions
    ],
)
def test_known_bearings_have_their_published_orders(name, bpfi, bpfo, twice_bsf, ftf):
    orders, rounded = load_bearing(name).orders, {"mafaulda-ball": 4, "rexnord-za-2115": 10}.get(name, 1)
    found = (orders.bpfi, orders.bpfo, 2 * orders.bsf, orders.ftf)
    assert found == pytest.approx((bpfi, bpfo, twice_bsf, ftf), abs=rounded * PUBLISHED_ORDER)
