"""The examples of the page on contributing are code that runs and files that are read."""

import re
from pathlib import Path
from typing import Any

import pytest

import srbval
from srbval.bearing import load_bearing
from srbval.recordings.datasets.description import DatasetDescription
from srbval.storage.tables import build, read_toml

PACKAGE = Path(srbval.__file__).parent
PAGE = (PACKAGE / "docs" / "contributing.md").read_text(encoding="utf-8")
BLOCKS = [
    (title, kind, text)
    for title, section in re.findall(r"^### (.*?)\n(.*?)(?=^##|\Z)", PAGE, flags=re.MULTILINE | re.DOTALL)
    for kind, text in re.findall(r"^```(python|toml)\n(.*?)^```", section, flags=re.MULTILINE | re.DOTALL)
]
ORDER_CONDITION = 1e-15  # rounding of sums of a tableau's fractions


def example(title: str) -> dict[str, Any]:
    """Run the code of an example and return the names that it defines."""
    space: dict[str, Any] = {"__name__": "example"}
    (text,) = (text for known, kind, text in BLOCKS if (known, kind) == (title, "python"))
    exec(compile(text, title, "exec", dont_inherit=True), space)
    return space


@pytest.mark.parametrize("title", [title for title, kind, _ in BLOCKS if kind == "python"])
def test_code_runs(title: str) -> None:
    assert example(title)


def test_the_tableau_is_of_its_order() -> None:
    """Weights and squares of the stages' times: the order conditions of the quadrature."""
    coefficients = example("A tableau")["RK38"].coefficients
    for power in range(4):
        assert coefficients.b @ coefficients.c**power == pytest.approx(1 / (power + 1), abs=ORDER_CONDITION)


def toml(title: str, tmp_path: Path) -> Path:
    (text,) = (text for known, kind, text in BLOCKS if (known, kind) == (title, "toml"))
    path = tmp_path / "example.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_the_bearing_is_a_bearing(tmp_path: Path) -> None:
    assert load_bearing(str(toml("A bearing", tmp_path))).orders == load_bearing("skf-6203").orders


def test_the_data_set_is_a_description(tmp_path: Path) -> None:
    description = build(DatasetDescription, read_toml(toml("A data set", tmp_path)), "example")
    assert description.name == "my-rig"


def test_every_file_that_is_named_is_there() -> None:
    root = PACKAGE.parent
    for name in re.findall(r"`((?:srbval|tests|data_manifest|reports)/[\w/.]+)`", PAGE):
        assert (root / name).exists(), name
