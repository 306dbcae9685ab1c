"""JSON objects of one line each, with a check value: what is read back is what was written, and of the right types."""

import enum
import hashlib
import json
import math
import re
import typing
from collections.abc import Mapping
from functools import cache
from types import UnionType
from typing import Any, TypeVar

from srbval.storage.strict_json import json_value, parse_json

T = TypeVar("T")
LINE = re.compile(rb'(\{.+), "check": "([0-9a-f]{32})"\}')
STRING = re.compile(rb'"(?:[^"\\]|\\.)*+"')
SURROGATE = re.compile("[\ud800-\udfff]")  # half a character: no file can hold one
MOST_BRACKETS = 500  # of a line, so that nothing is nested deeper than Python follows


def checked_line(value: Any) -> bytes:
    """A mapping or dataclass as one line of JSON, UTF-8, that ends with the hash of the text before it."""
    text = json.dumps(json_value(value), ensure_ascii=False)
    content = SURROGATE.sub("?", text).removesuffix("}").encode()
    return content + b', "check": "%s"}\n' % _check(content)


def read_checked_line(line: bytes) -> dict[str, Any]:
    """The object of a line, without its check value; `ValueError` where that does not fit, or for a hostile value.

    Nothing is parsed whose check value does not fit.
    """
    found = LINE.fullmatch(line.removesuffix(b"\n"))
    if found is None or _check(found[1]) != found[2]:
        raise ValueError("it does not fit its check value")
    structure = STRING.sub(b"", found[1])
    if structure.count(b"[") + structure.count(b"{") > MOST_BRACKETS:
        raise ValueError("too much is nested in it")
    table: dict[str, Any] = parse_json(found[1] + b"}")
    json.dumps(table, ensure_ascii=False).encode()  # no half characters
    return table


def from_json(cls: type[T], table: Any) -> T:
    """A dataclass from an object with exactly its fields; `ValueError` for a wrong type or an infinite number.

    A field may be a plain value, an enum, a mapping, or a tuple of such dataclasses.
    """
    hints: dict[str, Any] = _hints(cls)  # type: ignore[arg-type]
    if not isinstance(table, dict) or table.keys() != hints.keys():
        raise ValueError(f"its keys are not {', '.join(hints)}")
    return cls(**{name: _typed(name, table[name], hint) for name, hint in hints.items()})


@cache
def _hints(cls: type) -> dict[str, Any]:
    return typing.get_type_hints(cls)


def _typed(name: str, value: Any, hint: Any) -> Any:
    if typing.get_origin(hint) is tuple and isinstance(value, list):
        return tuple(from_json(typing.get_args(hint)[0], item) for item in value)
    for kind in typing.get_args(hint) if isinstance(hint, UnionType) else (typing.get_origin(hint) or hint,):
        if issubclass(kind, enum.Enum):
            return kind(value)
        if type(value) is (dict if kind is Mapping else kind) and value not in (math.inf, -math.inf):
            return value
    raise ValueError(f"{name} is of a wrong type")


def _check(content: bytes) -> bytes:
    return hashlib.sha256(content).hexdigest()[:32].encode()
