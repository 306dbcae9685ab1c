"""A case is checked key by key, and its file says the same as the case that wrote it."""

import dataclasses

import pytest

from srbval.bearing import Fault
from srbval.errors import ConfigurationError, DataError
from srbval.validation.case import Source, case_of_pairs, files_of_source, load_case, write_case

CASE = """
title = "A model of mine"
bearing = "skf-6205"
[simulated]
band_hz = [500, 1500]
unit = "m/s2"
[measured]
band_hz = [2000, 4000]
channel = "DE"
[tolerance]
cage_pct = 0.1
[uncertainty]
cage_pct = 0.05
[[pair]]
state = "outer"
measured = "OR.csv"
simulated = ["run1.csv", "run2.csv"]
[[pair]]
state = "inner"
measured = { file = "IR.csv", channel = "FE" }
simulated = { scene = "rig" }
used_for = "blind"
[[published]]
state = "outer"
rpm = 710
kinematic_hz = 96.79
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(CASE)
    return path


def test_settings_of_a_pair_go_over_those_of_its_side(file):
    case = load_case(file)
    outer, inner = case.pair
    assert (case.known_bearing.name, case.tolerance.cage_pct, case.published[0].kinematic_hz) == (
        "skf-6205",
        0.1,
        96.79,
    )
    assert case.side(outer, "measured") == Source(band_hz=(2000, 4000), channel="DE", file=("OR.csv",))
    measured = case.side(inner, "measured")
    assert measured is not None
    assert (measured.channel, measured.settings.band_hz, inner.used_for) == ("FE", (2000, 4000), "blind")
    assert case.side(inner, "simulated") == Source(band_hz=(500, 1500), unit="m/s2", scene="rig")


def test_a_written_case_is_the_same(file):
    case = load_case(file)
    write_case(case, file.with_name("again.toml"))
    again = load_case(file.with_name("again.toml"))
    assert dataclasses.replace(again, path=None) == dataclasses.replace(case, path=None)


def test_values_can_be_changed_by_their_keys(file):
    case = load_case(file, {"measured.channel": "BA", "tolerance.level_db": 3.0})
    assert (case.measured.channel, case.tolerance.level_db) == ("BA", 3.0)


def test_a_bearing_may_stand_in_the_case():
    orders = {"orders": {"rolling_elements": 9, "bpfo": 3.585, "bpfi": 5.415, "bsf": 2.357, "ftf": 0.398}}
    case = case_of_pairs([{"measured": "a.csv"}], orders)
    assert (case.known_bearing.rolling_elements, case.known_bearing.orders.bpfo) == (9, 3.585)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('title = "A model', 'tilte = "A model', "unknown key 'tilte'; did you mean 'title'"),
        ("cage_pct = 0.1", "cage_pct = -0.1", "tolerance cage_pct = -0.1 must be above 0"),
        ("band_hz = [500, 1500]", "band_hz = [1500, 500]", "the second edge must be above the first"),
        ('channel = "DE"', 'chanel = "DE"', "measured: unknown key 'chanel'; did you mean 'channel'"),
        ('state = "outer"\nmeasured', 'state = "outter"\nmeasured', "did you mean 'outer'"),
        ('used_for = "blind"', 'used_for = "fun"', "must be one of fit, withheld, blind"),
        ('bearing = "skf-6205"', 'bearing = "skf-6250"', "bearing 'skf-6250' is not known"),
        ('bearing = "skf-6205"', 'bearing = "skf-6205"\norders = { bpfo = 1 }', "not several"),
        ("[[pair]]", "[[paar]]", "unknown key 'paar'; did you mean 'pair'"),
        ('unit = "m/s2"', 'unit = "furlong"', "unit 'furlong' is not known"),
    ],
)
def test_what_is_wrong_is_said(file, old, new, said):
    file.write_text(CASE.replace(old, new))
    with pytest.raises(ConfigurationError) as raised:
        load_case(file)
    assert said in str(raised.value)


def test_a_case_without_pairs_and_an_unknown_name_are_refused(tmp_path):
    with pytest.raises(ConfigurationError, match=r"no \[\[pair\]\]"):
        case_of_pairs([])
    with pytest.raises(ConfigurationError, match="torino-22240"):
        load_case("torino")
    with pytest.raises(DataError):
        load_case(tmp_path / "none.toml")


def test_files_are_named_by_path_pattern_or_registered_name(tmp_path):
    for name in ("b2.csv", "b1.csv"):
        (tmp_path / name).touch()
    found = files_of_source(Source(file=("b*.csv", "OR_877rpm_sample")), tmp_path, "measured")
    assert [path.name for path in found][:2] == ["b1.csv", "b2.csv"]
    assert found[2].name.startswith("OR_877rpm_sample")
    for name, said in (("c*.csv", "no file fits the pattern"), ("c.csv", "no file"), ("OR_", "registered recordings")):
        with pytest.raises(DataError, match=said):
            files_of_source(Source(file=(name,)), tmp_path, "measured")


def test_the_shipped_case_is_the_paper_s():
    case = load_case("torino-22240")
    assert [row.state for row in case.published] == [Fault.OUTER, Fault.INNER]
    assert (case.simulated.band_hz, case.measured.band_hz, case.tolerance.cage_pct) == ((500, 1500), (1400, 2800), 0.1)
