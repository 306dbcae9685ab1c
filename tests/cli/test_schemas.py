"""Schemas of files: those shipped are made from the dataclasses, accept what the program reads, and no misspelt key."""

import json
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from srbval.cli import run_command_line
from srbval.storage.installation import package_folder, shipped_folder
from tests.cli.schemas import schemas

PACKAGE = package_folder()
SHIPPED = {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in (PACKAGE / "schemas").glob("*.json")}
FILES = {
    "scene": [PACKAGE / "scene" / f"{name}.toml" for name in ("paper", "rig", "rig-oil")],
    "case": sorted((shipped_folder("data_manifest") / "cases").glob("*.toml")),
    "campaign": sorted((PACKAGE / "campaign" / "presets").glob("*.toml")),
}
BLOCKS = {"scene": ("commands", 0), "campaign": ("commands", 1), "machine": ("your_data", 0)}  # of pages of the guide


def documents() -> Iterator[tuple[str, dict[str, Any]]]:
    for kind, files in FILES.items():
        tables = ((file.name, tomllib.loads(file.read_text(encoding="utf-8"))) for file in files)
        yield from (("scene" if name == "planar-6205.toml" else kind, table) for name, table in tables)
    for kind, (page, number) in BLOCKS.items():
        text = (PACKAGE / "docs" / "guide" / f"{page}.md").read_text(encoding="utf-8")
        yield kind, tomllib.loads(re.findall(r"```toml\n(.*?)\n```", text, flags=re.DOTALL)[number])


def misspelt(document: dict[str, Any]) -> Iterator[dict[str, Any]]:
    """The document with a letter more in one key, at each place but below the free keys of axes and of other tables."""
    for key, value in document.items():
        yield {k if k != key else f"{k}x": v for k, v in document.items()}
        if isinstance(value, dict) and key not in ("elements", "orders", "bearing"):
            yield from (document | {key: inner} for inner in misspelt(value))


def test_shipped_schemas_are_those_of_the_dataclasses_and_are_written_to_a_folder(tmp_path: Path) -> None:
    assert schemas() == SHIPPED, "python -m tests.cli.schemas makes them again"
    assert run_command_line(["doctor", "--schemas", str(tmp_path)]) == 0
    assert {path.stem: json.loads(path.read_text(encoding="utf-8")) for path in tmp_path.iterdir()} == SHIPPED


@pytest.mark.parametrize(("kind", "document"), list(documents()))
def test_files_that_the_program_reads_are_valid_and_misspelt_ones_not(kind: str, document: dict[str, Any]) -> None:
    check = pytest.importorskip("jsonschema").Draft7Validator(SHIPPED[kind])
    assert [error.message for error in check.iter_errors(document)] == []
    assert [wrong for wrong in misspelt(document) if check.is_valid(wrong)] == []


@pytest.mark.parametrize(
    ("kind", "document"),
    [
        ("scene", {"load": {"radial": 5.0}}),
        ("scene", {"load": {"radial": "5 kg"}}),
        ("scene", {"load": {"radial_n": -1.0}}),
        ("scene", {"defect": {"kind": "cage"}}),
        ("campaign", {"name": "c", "scene": {"laod": {}}}),
        ("machine", {"title": "m", "zones_mm_s": [1.0]}),
        ("case", {"path": "x"}),
    ],
)
def test_values_that_the_program_refuses_are_invalid(kind: str, document: dict[str, Any]) -> None:
    assert not pytest.importorskip("jsonschema").Draft7Validator(SHIPPED[kind]).is_valid(document)
