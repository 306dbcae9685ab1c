"""What the command line says to a slip of the finger, and how it completes."""

import json
import shutil
import subprocess
from pathlib import Path

import pytest

from srbval.cli import main

SLIPS = {
    "analyze x.mat": "analyse",
    "reprot": "report",
    "data lst": "list",
    "analyse x.mat --rmp 1480": "--rpm",
    "analyse x.mat --bering=skf-6205": "--bearing",
    "data add folder --pulses-per-revolution 2": "--pulses-per-rev",
    "data add folder --state outr": "outer",
    "kinematics --jason": "--json",
}


@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_is_answered_with_what_was_meant(slip: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(slip.split()) == 2
    said = capsys.readouterr().err
    assert f"Did you mean {SLIPS[slip]}? See: srbval" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("shtab")
    assert main(["completion", shell, "--json"]) == 0
    script = json.loads(capsys.readouterr().out)["script"]
    assert main(["completion", shell]) == 0
    assert capsys.readouterr().out.strip() == script.strip()
    for word in ("analyse", "kinematics", "pulses-per-rev", "healthy"):
        assert word in script
    if shell == "bash" and shutil.which("bash"):
        (tmp_path / "c").write_text(script)
        asked = 'source c; COMP_WORDS=(srbval ana); COMP_CWORD=1; _shtab_srbval; echo "${COMPREPLY[@]}"'
        found = subprocess.run(["bash", "-c", asked], cwd=tmp_path, capture_output=True, text=True, check=True)
        assert found.stdout.split() == ["analyse"]
