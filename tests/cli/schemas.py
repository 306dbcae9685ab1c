"""Make the JSON Schemas in ``srbval/schemas`` again after a change of a dataclass: ``python -m tests.cli.schemas``."""

import dataclasses
import enum
import json
import re
import types
import typing
from collections.abc import Mapping
from typing import Any

from srbval.bearing import Fault
from srbval.campaign.cases import Campaign
from srbval.cli.machine_file import Machine
from srbval.scene import Scene, SensorPath
from srbval.storage import tables
from srbval.storage.installation import package_folder
from srbval.storage.tables import JSON_TYPES, UNIT_FACTORS
from srbval.validation.case import CasePair, Source, ValidationCase

SIDE = str | tuple[str, ...] | Source  # file names, or a table with the key `file`
HINTS: dict[Any, Any] = {Fault: ("none", "ball"), (ValidationCase, "path"): None}
HINTS |= {(Campaign, "scene"): Scene, (Scene, "sensor_path"): str | SensorPath, (Machine, "bearing"): str | dict}
HINTS |= {(CasePair, "simulated"): SIDE, (CasePair, "measured"): SIDE, (Source, "file"): str | tuple[str, ...]}
KINDS = {"scene": Scene, "case": ValidationCase, "campaign": Campaign, "machine": Machine}
LIMIT_WORDS = ("exclusiveMinimum", "minimum", "maximum")  # names of the three limits of `limited`


def json_schema(cls: type, hints: Mapping[Any, Any]) -> dict[str, Any]:
    """JSON Schema (draft 7) of the files from which `build` creates a `cls`, for completion and checks in an editor.

    `hints` contains what the fields' types do not state. For a pair (class, field name) it contains the type in the
    file, if the program converts the value before it calls `build`, or None to omit the field. For an enum class it
    contains words that are accepted besides the enum's members. All keys of a file are optional.
    """
    definitions: dict[str, Any] = {}

    def of_table(kind: Any) -> dict[str, Any]:
        own, fields, spelling = tables._keys_of_fields(kind)
        keys = {
            key: of_value(hints.get((kind, name), own[name]), _number_schema(fields[name], key))
            for key, name in spelling.items()
            if hints.get((kind, name), own[name]) is not None
        }
        text = " ".join((kind.__doc__ or "").split("\n\n")[0].split())
        return {"description": text, "type": "object", "properties": keys, "additionalProperties": False}

    def of_value(hint: Any, number: dict[str, Any]) -> dict[str, Any]:
        kind, inner = typing.get_origin(hint) or hint, typing.get_args(hint)
        if kind in (types.UnionType, typing.Union):
            either = [of_value(one, number) for one in inner if one is not types.NoneType]
            return either[0] if len(either) == 1 else {"anyOf": either}
        if kind is tuple:
            size = {} if inner[1:] == (...,) else {"minItems": len(inner), "maxItems": len(inner)}
            return {"type": "array", "items": of_value(inner[0], number)} | size
        if dataclasses.is_dataclass(kind):
            name = typing.cast(type, kind).__name__
            if name not in definitions:
                definitions[name] = of_table(kind)
            return {"$ref": f"#/definitions/{name}"}
        if isinstance(kind, type) and issubclass(kind, enum.Enum):
            return {"enum": [*(member.value for member in kind), *hints.get(kind, ())]}
        if kind is float:
            return number
        limits = {word: number[word] for word in LIMIT_WORDS if word in number} if kind is int else {}
        return {"type": JSON_TYPES.get(kind, "object")} | limits

    return {"$schema": "http://json-schema.org/draft-07/schema#"} | of_table(cls) | {"definitions": definitions}


def _number_schema(field: dataclasses.Field[Any], key: str) -> dict[str, Any]:
    """JSON Schema of a number: in SI for a `key` like ``radial_n``, as text with a unit for one like ``radial``."""
    dimension, limits = field.metadata.get("dimension"), field.metadata.get("limits", ())
    stated = {word: limit for word, limit in zip(LIMIT_WORDS, limits, strict=False) if limit is not None}
    if dimension and key == field.name:
        return {"type": "number"} | stated
    units = UNIT_FACTORS[dimension or tables._number_without_dimension(field)]
    of_units = "|".join(map(re.escape, units))
    text = {"pattern": rf"^\s*[-+]?{tables._DIGITS}(?:\s*/\s*{tables._DIGITS})?\s*(?:{of_units})\s*$"}
    if dimension is None:
        return {"type": ["number", "string"], "description": "number, or text in %"} | stated | text
    return {"type": "string", "description": f"{dimension} in {', '.join(filter(None, units))}"} | text


def schemas() -> dict[str, dict[str, Any]]:
    """Schemas of scene, case, campaign and machine files, by name."""
    return {name: json_schema(kind, HINTS) for name, kind in KINDS.items()}


if __name__ == "__main__":
    for name, schema in schemas().items():
        file = package_folder() / "schemas" / f"{name}.json"
        file.write_text(json.dumps(schema, indent=1) + "\n", encoding="utf-8")
