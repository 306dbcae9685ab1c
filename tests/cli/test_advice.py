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
        ("study run naming", "JSON", "x.json"),
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


@pytest.mark.parametrize("stated", [["--band", "500", "3000"], ["--auto-band"]])
@pytest.mark.parametrize("bearing", [["--elements", "9,7.94,39.04,0"], ["--orders", "3.58,5.42,2.36,0.398"]])
def test_what_a_machines_file_states_is_registered_once(
    stated: list[str],
    bearing: list[str],
    two_channels: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """Band, dimensions and orders, by a machine's file or by options; what an option says goes over it."""
    monkeypatch.setenv("SRBVAL_HOME", str(two_channels.parent / "home"))
    options = ["--channel", "data[1]", *RECORD[2:8], *bearing, *stated]
    machine = two_channels.parent / "machine.toml"
    assert main(["analyse", str(two_channels), *options, "--write-machine", str(machine), "--json"]) == 0
    wanted = json.loads(capsys.readouterr().out)
    for given in (["--machine", str(machine)], options):
        assert main(["data", "add", "--repin", str(two_channels), *given]) == 0
        capsys.readouterr()
        assert main(["analyse", str(two_channels), "--json"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert [found[key] for key in ("band_hz", "lines", "bearing")] == [
            wanted[key] for key in ("band_hz", "lines", "bearing")
        ]
    assert main(["analyse", str(two_channels), "--band", "600", "2900", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["band_hz"] == [600, 2900]
    assert main(["data", "add", str(two_channels), "--band", "3000", "500"]) == 2
    assert "band 3000 to 500 Hz" in capsys.readouterr().err
    register = two_channels.parent / "home" / "manifest.json"
    older = json.loads(register.read_text(encoding="utf-8"))
    for key in ("band_hz", "auto_band"):
        del older["recordings"][0]["settings"][key]
    register.write_text(json.dumps(older), encoding="utf-8")
    assert main(["data", "list"]) == 0


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
