"""The README's commands are the ones that are run."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_ci_runs_the_readmes_test_command() -> None:
    report, tests = re.findall(r"```sh\n(.*?)\n```", README, flags=re.DOTALL)[:2]
    assert report.endswith("srbval report")
    assert tests.endswith("pytest")
    assert tests in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_the_scene_in_the_readme_is_a_scene(tmp_path: Path) -> None:
    from srbval.scene import load_scene

    (text,) = re.findall(r"```toml\n(.*?)\n```", README, flags=re.DOTALL)
    path = tmp_path / "scene.toml"
    path.write_text(text)
    assert load_scene(path).contact.roller_fit.value == "printed"


def test_folders_in_the_readme_exist() -> None:
    for name in re.findall(r"^\| `([a-z_/]+)` \|", README, flags=re.MULTILINE):
        if "/" in name or name in ("data_manifest", "reports"):
            assert (ROOT / name).is_dir(), name
