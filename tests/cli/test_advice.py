"""What a message advises is right, complete, and can be done."""

import json
from pathlib import Path

import numpy as np
import pytest

import srbval
from srbval.cli import main
from srbval.cli.arguments import parser
from srbval.errors import ConfigurationError
from srbval.models.simulate import simulate_to_file
from tests.recordings import files

DIGITS = 1e-12  # of the numbers written below
RECORD = ["--bearing", "skf-6205", "--rpm", "1500", "--fs", "8000", "--unit", "g", "--band", "500", "3000"]


@pytest.fixture
def two_channels(tmp_path: Path) -> Path:
    np.save(tmp_path / "two.npy", np.stack([files.vibration(40_000, seed) for seed in range(2)], axis=1))
    return tmp_path / "two.npy"


@pytest.mark.parametrize("text", ["1/61440", "1/61440 s", "1 / 61.44 ms", "1.627604166667e-5", "16.27604166667us"])
def test_a_step_as_scene_files_have_it(text: str) -> None:
    assert parser().parse_args(["simulate", "--dt", text]).dt == pytest.approx(1 / 61440, rel=DIGITS)
    if text[-1] == "s":
        assert srbval.paper_scene(solver={"step": text}).solver.step_s == pytest.approx(1 / 61440, rel=DIGITS)


@pytest.mark.parametrize(
    ("command", "content", "better"),
    [
        ("simulate --model auto", "HDF5", "x.h5"),
        ("identify no.mat", "TOML", "x.toml"),
        ("study run noise", "JSON", "x.json"),
    ],
)
def test_a_file_is_what_its_name_says(
    command: str, content: str, better: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "x.csv"
    assert main([*command.split(), "-o", str(path)]) == 2
    assert f"{content} is written, which .csv is not; name it {better}" in capsys.readouterr().err
    with pytest.raises(ConfigurationError, match="HDF5 is written"):
        simulate_to_file(srbval.paper_scene(), path)
    assert list(tmp_path.iterdir()) == []


def test_everything_missing_is_asked_for_at_once(two_channels: Path, capsys: pytest.CaptureFixture[str]) -> None:
    questions = ["--channel data[1] | data[2]", "--fs HZ", "--unit", "--bearing", "--rpm R"]
    assert main(["analyse", str(two_channels)]) == 3
    said = capsys.readouterr().err
    assert [asked for asked in (*questions, "--band LO HI, or --auto-band") if asked not in said] == []
    assert main(["analyse", str(two_channels), "--band", "500", "3000", "--rpm", "1500"]) == 3
    said = capsys.readouterr().err.split("For example")[0]
    assert ("--band" in said, "no shaft speed" in said, "--unit" in said) == (False, False, True)
    assert main(["analyse", str(two_channels), "--channel", "data[1]", "--fs", "8000", "--unit", "g"]) == 2
    said = capsys.readouterr().err
    assert [asked for asked in ("no bearing", "no shaft speed", "no demodulation band") if asked not in said] == []
    assert main(["data", "add", str(two_channels)]) == 0
    (said,) = [line for line in capsys.readouterr().out.splitlines() if "not stated" in line]
    assert [asked for asked in (*questions, "--tacho") if asked not in said] == []
    assert main(["data", "add"]) == 2
    assert "name a folder or a file" in capsys.readouterr().err
    for command in (["report", "-o", str(two_channels.parent / "report")], ["identify"]):
        assert main([*command, str(two_channels)]) == 3
        said = capsys.readouterr().err
        assert ([asked for asked in questions if asked not in said], "srbval analyse" in said) == ([], False)


def test_a_ball_is_a_rolling_element(two_channels: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The field's word for it in a ball bearing."""
    found = []
    for part in ("ball", "roller"):
        command = ["analyse", str(two_channels), "--channel", "data[1]", *RECORD, "--defect", part, "--json"]
        assert main(command) == 0
        found.append(json.loads(capsys.readouterr().out)["lines"])
    assert found[0] == found[1]
    assert {line["name"][:5] for line in found[0]} == {"2xBSF"}
    assert main(["data", "add", str(two_channels), "--state", "ball", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["recordings"][0]["state"] == "roller"
