"""The README's commands are those of `.ci/run`, and its links exist."""

import json
import re
import tomllib
from pathlib import Path

import pandas as pd

from srbval.recordings.loaders import FILE_FORMATS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_ci_runs_the_readmes_test_command():
    commands = [block for block in re.findall(r"```sh\n(.*?)\n```", README, flags=re.DOTALL) if "venv" in block]
    installation, tests = commands
    assert README.index(installation) < README.index("srbval analyse")
    assert ".venv/bin/pytest" in tests
    assert tests in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_the_extra_for_formats_brings_what_they_need():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    in_formats = {re.split(r"[<>=]", library)[0] for library in extras["formats"]}
    assert {form.library[1] for form in FILE_FORMATS if form.library} - {"h5py", "pandas", "scipy"} == in_formats
    assert '".[pdf,formats]"' in README


def test_what_the_readme_points_to_exists():
    for place in re.findall(r"\]\(([\w/.]+)\)", README):
        assert (ROOT / place).exists(), place


def test_the_graded_benchmark_is_the_stored_one():
    stored = pd.DataFrame(json.loads((ROOT / "reports" / "naming.json").read_text(encoding="utf-8"))["graded"]["table"])
    columns = ["records", "right", "wrong", "public_right", "public_wrong"]
    every = stored[stored["part"] == "all"].set_index("grade")[columns]
    records, right, wrong, *public = every.loc[["Y1", "Y2"]].sum().tolist()
    ours = f"For the {records} diagnosable recordings (grades Y1 and Y2), srbval names {right} faults correctly"
    theirs = f"a public diagnosis program {public[0]} correctly and {public[1]} wrongly"
    assert f"{ours} and {wrong} wrongly, {theirs}" in " ".join(README.split())
