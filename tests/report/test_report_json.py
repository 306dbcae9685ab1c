"""report.json is strict JSON and carries what the pages show."""

import enum
import json
from pathlib import Path

import numpy as np
import pytest

from srbval.report import Badge
from srbval.report.json_file import report_data
from srbval.storage.strict_json import strict_json, write_json


def refuse(name):
    raise AssertionError(name)


def test_everything_known_becomes_plain_json():
    value = {
        "f": np.float32(0.5), "n": float("nan"), "i": np.inf, "a": np.array([1.0, np.nan]), "t": (1, True),
        "e": Badge.MEASURED, "p": Path("a/b"),
    }  # fmt: skip
    read = json.loads(strict_json(value), parse_constant=refuse)
    assert read == {
        "f": 0.5, "n": None, "i": None, "a": [1.0, None], "t": [1, True], "e": "measured", "p": "a/b"
    }  # fmt: skip


def test_an_enum_of_floats_is_made_finite_too():
    class Odd(enum.Enum):
        NOTHING = float("nan")

    assert json.loads(strict_json([Odd.NOTHING])) == [None]


@pytest.mark.parametrize("value", [{1: 2}, object(), {"a": {1, 2}}])
def test_what_json_does_not_know_is_refused(value):
    with pytest.raises(TypeError):
        strict_json(value)


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "report.json"
    write_json(path, {"old": 1})
    with pytest.raises(TypeError):
        write_json(path, {"new": object()})
    assert json.loads(path.read_text()) == {"old": 1}
    assert list(tmp_path.iterdir()) == [path]


def test_a_damaged_file_name_is_still_valid_json(tmp_path):
    path = tmp_path / "report.json"
    write_json(path, {"file": "a\udc80b"})
    assert json.loads(path.read_bytes()) == {"file": "a\udc80b"}


def test_figures_are_listed_from_the_tree(report):
    data = report_data(report)
    assert [f["id"] for f in data["figures"]] == ["fig11b", "fig12a"]
    assert data["figures"][0]["file"] == "figures/fig11b.svg"
    assert data["figures"][0]["data"] == "figures/fig11b.csv"
    assert data["figures"][0]["synthetic"] is True
