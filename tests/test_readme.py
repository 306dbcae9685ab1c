"""The README's commands are the ones that are run, and the files shown in the guide are read."""

import re
import tomllib
from pathlib import Path

from srbval.recordings.loaders import FORMATS

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMANDS = (ROOT / "srbval" / "docs" / "guide" / "commands.md").read_text(encoding="utf-8")


def test_ci_runs_the_readmes_test_command() -> None:
    commands = [block for block in re.findall(r"```sh\n(.*?)\n```", README, flags=re.DOTALL) if "venv" in block]
    report, tests = commands
    assert report.endswith("srbval report")
    assert ".venv/bin/pytest" in tests
    assert tests in (ROOT / ".ci" / "run").read_text(encoding="utf-8").splitlines()


def test_nothing_says_to_install_srbval_from_an_index() -> None:
    """It is on none: in documents a folder or a wheel is named, in messages the libraries alone."""
    texts = [path for kind in ("*.md", "*.py", "*.toml", "*.ipynb") for path in (ROOT / "srbval").rglob(kind)]
    for path in (*texts, ROOT / "README.md", ROOT / "CHANGELOG.md", *(ROOT / "notebooks").glob("*.ipynb")):
        assert not re.search(r"pip install[^\n&#]*[\s\"']srbval(?!-\d)\b", path.read_text(encoding="utf-8")), path
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    in_formats = {re.split(r"\W", library)[0] for library in extras["formats"]}
    assert {form.library[1] for form in FORMATS if form.library} - {"scipy"} == in_formats
    assert '".[pdf,formats]"' in README


def test_what_the_readme_points_to_exists() -> None:
    for place in re.findall(r"\]\(([\w/.]+)\)", README):
        assert (ROOT / place).exists(), place


def test_the_scene_in_the_guide_is_a_scene(tmp_path: Path) -> None:
    from srbval.scene import load_scene

    text, _ = _toml_blocks()
    path = tmp_path / "scene.toml"
    path.write_text(text)
    assert load_scene(path).contact.roller_fit.value == "printed"


def test_the_campaign_in_the_guide_is_a_campaign(tmp_path: Path) -> None:
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
    return re.findall(r"```toml\n(.*?)\n```", COMMANDS, flags=re.DOTALL)
