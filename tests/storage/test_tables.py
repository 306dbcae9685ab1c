import enum
import math
from dataclasses import dataclass

import pytest

from srbval.errors import ConfigurationError
from srbval.storage.tables import build, parse_quantity, quantity

ROUNDING = 1e-15  # relative; a product of two floating-point numbers


class Side(enum.StrEnum):
    LEFT = "left"
    RIGHT = "right"


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
     ("1e-8 m", "length", 1e-8), ("0.2mm", "length", 2e-4), ("5 %", "one", 0.05)],
)  # fmt: skip
def test_quantities_with_units(text: str, dimension: str, value: float) -> None:
    assert parse_quantity(text, dimension, "here") == pytest.approx(value, rel=ROUNDING)


def test_every_kind_of_field_is_read() -> None:
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
        ({"parts": [{"radial_n": "5 N"}]}, "number in SI"),
        ({"parts": [{"radial": "5 N", "radial_n": 5.0}]}, "given twice"),
        ({"parts": [{"radail": "5 N"}]}, "did you mean 'radial'"),
        ({"parts": [{}]}, "missing key 'radial_n'"),
        ({"parts": [3]}, "expected a table"),
        ({"parts": [{"radial": "5 N", "count": True}]}, "expected int"),
        ({"parts": [{"radial": "2 s"}]}, r"t\.parts\[0\]\.radial: unit 's' of '2 s' is not a force unit"),
        ({"colour": 1}, r"unknown key 'colour'; known: .*side"),
    ],
)
def test_the_place_of_a_wrong_value_is_named(table: dict[str, object], message: str) -> None:
    with pytest.raises(ConfigurationError, match=message):
        build(Every, table, "t")
