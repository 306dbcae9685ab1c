"""The README's commands are the ones that are run."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def test_ci_runs_the_readmes_test_command() -> None:
    report, tests = re.findall(r"```sh\n(.*?)\n```", README, flags=re.DOTALL)[:2]
    assert report.endswith("srbval report")
    assert ".venv/bin/pytest" in tests
    assert tests in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_the_scene_in_the_readme_is_a_scene(tmp_path: Path) -> None:
    from srbval.scene import load_scene

    text, _ = _toml_blocks()
    path = tmp_path / "scene.toml"
    path.write_text(text)
    assert load_scene(path).contact.roller_fit.value == "printed"


def test_the_campaign_in_the_readme_is_a_campaign(tmp_path: Path) -> None:
    from srbval.campaign.planning import plan_cases
    from srbval.campaign.settings import load_campaign

    _, text = _toml_blocks()
    path = tmp_path / "campaign.toml"
    path.write_text(text)
    cases = plan_cases(load_campaign(str(path)))
    assert len(cases) == 2 * 3 * 8
    assert not any(case.refused for case in cases)


def _toml_blocks() -> list[str]:
    """The scene and the campaign."""
    return re.findall(r"```toml\n(.*?)\n```", README, flags=re.DOTALL)


def test_folders_in_the_readme_exist() -> None:
    for name in re.findall(r"^\| `([a-z_/]+)` \|", README, flags=re.MULTILINE):
        if "/" in name or name in ("data_manifest", "reports"):
            assert (ROOT / name).is_dir(), name
