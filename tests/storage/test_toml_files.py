"""TOML files and their values: built into dataclasses, or refused at once with one printable line."""

import codecs
import enum
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, make_dataclass, replace
from types import SimpleNamespace

import pytest

from srbval import ConfigurationError, DataError, RunStatus, SrbvalError, load_bearing, load_campaign
from srbval.models.simulate import simulate, simulate_to_file
from srbval.scene import SpeedProfile, load_scene, paper_scene
from srbval.storage.tables import build, parse_quantity, quantity, read_toml

ROUNDING = 1e-15  # relative; a product of two floating-point numbers


class Side(enum.StrEnum):
    LEFT = "left"
    RIGHT = "right"


def test_an_alias_stands_for_its_type() -> None:
    """From NumPy 2.5 on, `NDArray` is such an alias where Python has them."""
    held = make_dataclass("Held", [("samples", SimpleNamespace(__value__=list[int]))])
    assert build(held, {"samples": [1, 2]}, "held").samples == [1, 2]


@dataclass(frozen=True, kw_only=True)
class Part:
    radial_n: float = quantity("force")
    count: int = 3


@dataclass(frozen=True, kw_only=True)
class Every:
    """One field of each kind that a configuration may hold."""

    side: Side = Side.LEFT
    share: float = 0.0
    times_s: tuple[float, ...] = quantity("time", default=())
    names: tuple[str, ...] = ()
    parts: tuple[Part, ...] = ()
    seed: int | None = None
    whole: bool = False


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [("124.8 kN", "force", 124_800.0), ("710 rpm", "speed", 710 * 2 * math.pi / 60), ("-90 deg", "angle", -math.pi / 2),
     ("1e-8 m", "length", 1e-8), ("0.2mm", "length", 2e-4), ("0.5 h", "time", 1800.0), ("5 %", "one", 0.05)],
)  # fmt: skip
def test_quantities_with_units(text, dimension, value):
    assert parse_quantity(text, dimension, "here") == pytest.approx(value, rel=ROUNDING)


def test_a_byte_order_mark_is_no_part_of_a_file(tmp_path):
    """Windows' editors put one before UTF-8 text: scenes, bearings, campaigns, machines and cases."""
    (tmp_path / "file.toml").write_bytes(codecs.BOM_UTF8 + b'duration = "1 h"')
    assert read_toml(tmp_path / "file.toml") == {"duration": "1 h"}


def test_every_kind_of_field_is_read():
    table = {
        "side": "right", "share": "5 %", "times": ["1 s", "20 ms"], "names": ["a", "b"],
        "parts": [{"radial": "2 kN"}, {"radial_n": 3.0}], "seed": 7, "whole": True,
    }  # fmt: skip
    assert build(Every, table, "t") == Every(
        side=Side.RIGHT, share=0.05, times_s=(1.0, 0.02), names=("a", "b"),
        parts=(Part(radial_n=2000.0), Part(radial_n=3.0)), seed=7, whole=True,
    )  # fmt: skip
    assert build(Every, {}, "t") == Every()
    assert build(Every, {"times_s": [1, 2.5]}, "t").times_s == (1.0, 2.5)


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"side": "rihgt"}, r"t\.side: 'rihgt' is not known; did you mean 'right'"),
        ({"times": ["1 s", 2.0]}, r"t\.times\[1\]: 2\.0 has no unit"),
        ({"names": "a"}, r"t\.names: expected a list"),
        ({"parts": [{"radial": 5.0}]}, r"5\.0 has no unit.*radial_n"),
        ({"parts": [{"radial_n": "5 N"}]}, "is text. Write .* number in SI"),
        ({"parts": [{"radial": "5 N", "radial_n": 5.0}]}, "only one of the keys 'radial' and 'radial_n'"),
        ({"parts": [{"radail": "5 N"}]}, "did you mean 'radial'"),
        ({"parts": [{}]}, "missing key 'radial_n'"),
        ({"parts": [3]}, "expected a table"),
        ({"parts": [{"radial": "5 N", "count": True}]}, "expected integer"),
        ({"parts": [{"radial": "2 s"}]}, r"t\.parts\[0\]\.radial: unit 's' of '2 s' is not known here; known: N"),
        ({"colour": 1}, r"unknown key 'colour'; known: .*side"),
    ],
)
def test_the_place_of_a_wrong_value_is_named(table, message):
    with pytest.raises(ConfigurationError, match=message):
        build(Every, table, "t")


LONGEST = SrbvalError.longest + 20
READERS: list[Callable[[str], object]] = [load_scene, load_bearing, load_campaign]
TEXTS = {
    "5,000 digits": "seed = " + "9" * 5000,
    "1e400": 'duration_s = 1e400\n[load]\nradial = "1e400 kN"',
    "nested lists": "seed = " + "[" * 20_000 + "]" * 20_000,
    "dotted key": ".".join("a" * 20_000) + " = 1",
    "long key": "a" * 1_000_000 + " = 1",
    "control characters": '"\\u0000\\u001b[2J\\n\\u202e" = 1',
    "long value": f'bearing = 5\nmodel = "{"x" * 1_000_000}"',
    "long number": f'duration = "{"1" * 1_000_000}\\nx"',
    "date": "seed = 1979-05-27",
    "NUL": "seed = \0",
    "not UTF-8": b"bearing = '\xff'",
    "surrogate": 'bearing = "\\ud800"',
    "2 MB": "# " + "x" * 2**21,
}


def refused(act: Callable[[], object]) -> str:
    with pytest.raises((ConfigurationError, DataError)) as caught:
        act()
    text = str(caught.value)
    assert text.isprintable()
    assert len(text) < LONGEST
    return text


@pytest.mark.timeout(60)
@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.__name__)
@pytest.mark.parametrize("what", TEXTS)
def test_hostile_texts(what, reader, tmp_path):
    path, text = tmp_path / "file.toml", TEXTS[what]
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    assert "file.toml" in refused(lambda: reader(str(path)))


@pytest.mark.timeout(60)
def test_a_pipe_that_a_campaign_names(tmp_path):
    os.mkfifo(tmp_path / "pipe.toml")
    (tmp_path / "campaign.toml").write_text('name = "a"\nscene_file = "pipe.toml"')
    assert "pipe.toml" in refused(lambda: load_campaign(str(tmp_path / "campaign.toml")))


VALUES = [10**400, -(10**400), 10**5000, "1e400 kN", "9" * 5000, math.inf, math.nan, [[]], {}, "5", "5 lbf", "kN",
          "1e999 N", "nan N", True, None, [1]]  # fmt: skip


@pytest.mark.parametrize("value", VALUES, ids=range(len(VALUES)))
def test_hostile_quantities(value):
    assert refused(lambda: parse_quantity(value, "force", "here")).startswith("here")


def test_what_fits_nowhere_is_refused_before_it_starts(tmp_path):
    """Days of signals in memory or on the disk; an hour may be streamed."""
    days = paper_scene(duration_s=5e5)
    with pytest.raises(ConfigurationError, match=r"GB of memory, there are .* GB.*use -o"):
        simulate(days)
    with pytest.raises(ConfigurationError, match=r"GB of (disk|memory)"):
        simulate_to_file(days, tmp_path / "run.h5")
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(ConfigurationError, match="passages"):
        simulate(paper_scene(model="impulse", duration_s=1e4, output_rate_hz=100.0, shaft_speed_rad_s=5e4, settle_s=0.0,
                             solver={"step_s": 1e-4}, defect={"kind": "outer"}))  # fmt: skip


def test_a_shaft_that_hardly_turns_and_one_that_spins():
    """No passage at all, and far more of them than the mean speed lets expect."""
    short = {"model": "impulse", "defect": {"kind": "inner"}, "duration_s": 0.003, "settle_s": 0.0}
    slow = simulate(paper_scene(shaft_speed_rad_s=0.005, **short))
    assert slow.samples == 61
    assert abs(slow.acceleration_m_s2).max() == 0
    assert simulate(paper_scene(shaft_speed_rad_s=9e4, **short)).status is RunStatus.OK
    profile = SpeedProfile(time_s=(0.0, 10.0), speed_rad_s=(0.0, 100.0))  # its slow start made every pulse 10 s wide
    assert simulate(replace(paper_scene(**short), duration_s=10.0, speed_profile=profile)).samples == 204_800
