"""Whatever the package holds becomes strict JSON, or is refused; a file is whole or is not there."""

import enum
import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest

from srbval.arrays import FloatArray
from srbval.storage.json_files import from_json, json_text, parse_json, to_json


class Side(enum.StrEnum):
    LEFT = "left"


class Code(enum.Enum):
    ONE = 1
    NOTHING = float("nan")


class Point(NamedTuple):
    x: float
    y: float


@dataclass(frozen=True, kw_only=True)
class Part:
    JSON_PROPERTIES: ClassVar = ("doubled",)

    value: float
    side: Side = Side.LEFT

    @property
    def doubled(self) -> float:
        return 2 * self.value


@dataclass(frozen=True)
class OwnShape:
    part: Part

    def to_dict(self) -> dict[str, Any]:
        return {"inner": self.part, "n": np.int64(3)}


def read(value: Any) -> Any:
    """What a strict reader finds in the document of `value`."""

    def refuse(name: str) -> None:
        raise AssertionError(name)

    return json.loads(json_text(value), parse_constant=refuse)


PART = {"value": 1.5, "side": "left", "doubled": 3.0}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.bool_(True), True),
        (np.str_("text"), "text"),
        (float("nan"), None),
        (-np.inf, None),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        (Point(1.0, 2.0), [1.0, 2.0]),
        (Path("a/b"), "a/b"),
        (datetime(2026, 1, 2, tzinfo=UTC), "2026-01-02T00:00:00+00:00"),
        (Side.LEFT, "left"),
        (Code.NOTHING, None),
        ({Side.LEFT: 1}, {"left": 1}),
        (MappingProxyType({"b": 1, "a": (2,)}), {"b": 1, "a": [2]}),
    ],
    ids=repr,
)
def test_values_become_plain_json(value, expected):
    assert read(value) == expected
    assert type(to_json(value)) in (str, int, float, bool, list, dict, type(None))


def test_a_class_with_a_shape_of_its_own_says_so():
    assert to_json(OwnShape(Part(value=1.5))) == {"inner": PART, "n": 3}
    assert list(to_json(Part(value=0.0))) == ["value", "side", "doubled"]  # fields, then properties
    assert json_text({"unit": "µm"}) == '{\n  "unit": "µm"\n}\n'


UNWRITABLE = {"number key": {1: 2}, "enum key": {Code.ONE: 2}, "object": object(), "set": {"a": {1, 2}}, "class": Part}
UNWRITABLE |= {"complex": 1j, "bytes": b"x"}


@pytest.mark.parametrize("value", UNWRITABLE.values(), ids=UNWRITABLE)
def test_what_json_does_not_know_is_refused(value):
    with pytest.raises(TypeError):
        json_text(value)


@pytest.mark.parametrize("text", ["[" * 20_000, "1" * 5_000, "NaN", "-Infinity", b"\xff\xfe\x00", "{", ""])
def test_a_damaged_document_is_a_value_error(text):
    with pytest.raises(ValueError, match=r"\S"):
        parse_json(text)


@dataclass(frozen=True, kw_only=True, eq=False)
class Record:
    JSON_OMITTED: ClassVar = ("cached",)

    part: Part
    file: Path
    values: FloatArray
    rows: tuple[tuple[float, ...], ...]
    pair: tuple[str, int]
    by_side: Mapping[Side, Part | None]
    either: float | int | str
    error: float
    limit: float | None = None
    cached: bool = False


RECORD = Record(
    part=Part(value=1.5), file=Path("a/b"), values=np.array([1.0, np.nan]), rows=((1.0, 2.0), ()), pair=("a", 3),
    by_side={Side.LEFT: None}, either=3, error=float("nan"),
)  # fmt: skip


def test_what_was_written_is_read_again():
    again = from_json(Record, json.loads(json_text(RECORD)))
    assert json_text(again) == json_text(RECORD)
    assert (again.part, again.file, again.rows, again.pair) == (RECORD.part, RECORD.file, RECORD.rows, RECORD.pair)
    assert (again.by_side, type(again.either), again.limit) == (RECORD.by_side, int, None)
    np.testing.assert_array_equal(again.values, RECORD.values)
    assert np.isnan(again.error)


@pytest.mark.parametrize(
    "change",
    [
        {"pair": ["a"]}, {"pair": "ab"}, {"pair": ["a", 1.5]}, {"rows": [["1"]]}, {"by_side": {"up": None}},
        {"part": {"value": 1.5}}, {"part": 3}, {"error": "1"}, {"error": True}, {"limit": 1e999}, {"limit": 10**400},
        {"file": 3}, {"either": []}, {"other": 1},
    ],
    ids=repr,
)  # fmt: skip
def test_another_table_is_a_value_error(change):
    with pytest.raises(ValueError, match=r"\S"):
        from_json(Record, to_json(RECORD) | change)
