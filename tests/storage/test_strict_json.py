"""Whatever the package holds becomes strict JSON, or is refused; a file is whole or is not there."""

from __future__ import annotations

import enum
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import numpy as np
import pytest

from srbval.storage.strict_json import json_object, json_value, parse_json, strict_json, write_json


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Whole:
    JSON_OMITTED: ClassVar = ("signal",)
    JSON_PROPERTIES: ClassVar = ("parts_by_side", "worst")

    file: Path
    parts: tuple[Part, ...]
    signal: np.ndarray = field(default_factory=lambda: np.zeros(3))
    first: Part | None = None

    @property
    def parts_by_side(self) -> dict[Side, Part]:
        return {part.side: part for part in self.parts}

    @property
    def worst(self) -> np.float64:
        return np.float64(np.inf)


@dataclass(frozen=True)
class OwnShape:
    part: Part

    def to_dict(self) -> dict[str, Any]:
        return {"inner": self.part, "n": np.int64(3)}


def read(value: Any) -> Any:
    """What a strict reader finds in the document of `value`."""

    def refuse(name: str) -> None:
        raise AssertionError(name)

    return json.loads(strict_json(value), parse_constant=refuse)


PART = {"value": 1.5, "side": "left", "doubled": 3.0}


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (np.float32(0.5), 0.5),
        (np.bool_(True), True),
        (np.int64(7), 7),
        (np.str_("text"), "text"),
        (float("nan"), None),
        (-np.inf, None),
        (np.array([[1.0, np.nan]]), [[1.0, None]]),
        ((1, True, None), [1, True, None]),
        (Point(1.0, 2.0), [1.0, 2.0]),
        (Path("a/b"), "a/b"),
        (datetime(2026, 1, 2, tzinfo=UTC), "2026-01-02T00:00:00+00:00"),
        (Side.LEFT, "left"),
        (Code.ONE, 1),
        (Code.NOTHING, None),
        ({Side.LEFT: 1}, {"left": 1}),
        (MappingProxyType({"b": 1, "a": (2,)}), {"b": 1, "a": [2]}),
    ],
    ids=repr,
)
def test_values_become_plain_json(value: Any, expected: Any) -> None:
    assert read(value) == expected
    assert type(json_value(value)) in (str, int, float, bool, list, dict, type(None))


def test_a_dataclass_is_written_with_its_fields_and_named_properties() -> None:
    whole = Whole(file=Path("x/y.mat"), parts=(Part(value=1.5),), first=Part(value=float("nan")))
    assert read(whole) == {
        "file": "x/y.mat",
        "parts": [PART],
        "first": {"value": None, "side": "left", "doubled": None},
        "parts_by_side": {"left": PART},
        "worst": None,
    }


def test_keys_keep_the_order_of_fields_then_properties() -> None:
    assert list(json_object(Part(value=0.0))) == ["value", "side", "doubled"]
    assert list(json_value({"z": 1, "a": 2})) == ["z", "a"]


def test_a_class_with_a_shape_of_its_own_says_so() -> None:
    assert read([OwnShape(Part(value=1.5))]) == [{"inner": PART, "n": 3}]
    assert json_object(OwnShape(Part(value=1.5))) == {"inner": PART, "n": 3}


UNWRITABLE = {"number key": {1: 2}, "enum key": {Code.ONE: 2}, "object": object(), "set": {"a": {1, 2}}, "class": Part}
UNWRITABLE |= {"complex": 1j, "bytes": b"x"}


@pytest.mark.parametrize("value", UNWRITABLE.values(), ids=UNWRITABLE)
def test_what_json_does_not_know_is_refused(value: Any) -> None:
    with pytest.raises(TypeError):
        strict_json(value)


def test_a_document_ends_with_a_newline_and_keeps_its_letters() -> None:
    assert strict_json({"unit": "µm"}) == '{\n  "unit": "µm"\n}\n'


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    write_json(path, {"old": 1})
    with pytest.raises(TypeError):
        write_json(path, {"new": object()})
    assert json.loads(path.read_text()) == {"old": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_damaged_file_name_is_still_valid_json(tmp_path: Path) -> None:
    path = tmp_path / "report.json"
    document: Mapping[str, str] = {"file": "a\udc80b"}
    write_json(path, document)
    assert json.loads(path.read_bytes()) == document


@pytest.mark.parametrize("text", ["[" * 20_000, "1" * 5_000, "NaN", "-Infinity", b"\xff\xfe\x00", "{", ""])
def test_a_damaged_document_is_a_value_error(text: str | bytes) -> None:
    with pytest.raises(ValueError, match=r"\S"):
        parse_json(text)


def test_a_document_is_parsed() -> None:
    assert parse_json(b'{"a": [1, 2.5, null]}') == {"a": [1, 2.5, None]}
