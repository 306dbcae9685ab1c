"""Advice in messages is right, complete, and can be done; slips of the finger, and how a shell completes."""

import json
import shutil
import subprocess

import numpy as np
import pytest

import srbval
from srbval.cli.arguments import parser
from srbval.errors import ConfigurationError
from srbval.models.simulate import simulate_to_file
from tests.recordings import files

DIGITS = 1e-12  # of the numbers written below
RECORD = ["--bearing", "skf-6205", "--rpm", "1500", "--fs", "8000", "--unit", "g", "--band", "500", "3000"]
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
def test_a_slip_is_answered_with_what_was_meant(slip, srbval_text):
    said = srbval_text(*slip.split(), code=2).err
    assert f"Did you mean {SLIPS[slip]}? See: srbval" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell, tmp_path, srbval_text, srbval_json):
    pytest.importorskip("shtab")
    script = srbval_json("completion", shell)["script"]
    assert srbval_text("completion", shell).out.strip() == script.strip()
    for word in ("analyse", "kinematics", "pulses-per-rev", "healthy"):
        assert word in script
    if shell == "bash" and shutil.which("bash"):
        (tmp_path / "c").write_text(script)
        asked = 'source c; COMP_WORDS=(srbval ana); COMP_CWORD=1; _shtab_srbval; echo "${COMPREPLY[@]}"'
        found = subprocess.run(["bash", "-c", asked], cwd=tmp_path, capture_output=True, text=True, check=True)
        assert found.stdout.split() == ["analyse"]


@pytest.fixture
def two_channels(tmp_path):
    np.save(tmp_path / "two.npy", np.stack([files.vibration(40_000, seed) for seed in range(2)], axis=1))
    return tmp_path / "two.npy"


@pytest.mark.parametrize("text", ["1/61440", "1/61440 s", "1 / 61.44 ms", "1.627604166667e-5", "16.27604166667us"])
def test_a_step_as_scene_files_have_it(text):
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
def test_a_file_is_what_its_name_says(command, content, better, tmp_path, srbval_text):
    path = tmp_path / "x.csv"
    said = srbval_text(*command.split(), "-o", path, code=2).err
    assert f"{content} is written, which .csv is not; name it {better}" in said
    with pytest.raises(ConfigurationError, match="HDF5 is written"):
        simulate_to_file(srbval.paper_scene(), path)
    assert list(tmp_path.iterdir()) == []


def test_everything_missing_is_asked_for_at_once(two_channels, srbval_text):
    questions = ["--channel data[1] | data[2]", "--fs HZ", "--unit", "--bearing", "--rpm R"]

    def unasked(said, *more):
        return [asked for asked in (*questions, *more) if asked not in said]

    assert unasked(srbval_text("analyse", two_channels, code=3).err, "--band LO HI, or --auto-band") == []
    said = srbval_text("analyse", two_channels, "--band", "500", "3000", "--rpm", "1500", code=3).err
    said = said.split("For example")[0]
    assert ("--band" in said, "no shaft speed" in said, "--unit" in said) == (False, False, True)
    said = srbval_text("analyse", two_channels, "--channel", "data[1]", "--fs", "8000", "--unit", "g", code=2).err
    assert [asked for asked in ("no bearing", "no shaft speed", "no demodulation band") if asked not in said] == []
    (said,) = [line for line in srbval_text("data", "add", two_channels).out.splitlines() if "not stated" in line]
    assert unasked(said, "--tacho") == []
    assert "name a folder or a file" in srbval_text("data", "add", code=2).err
    for command in (["report", "-o", two_channels.parent / "report"], ["identify"]):
        said = srbval_text(*command, two_channels, code=3).err
        assert (unasked(said), "srbval analyse" in said) == ([], False)


@pytest.mark.parametrize(
    ("bearing", "stated"),
    [
        (["--elements", "9,7.94,39.04,0"], ["--band", "500", "3000"]),
        (["--orders", "3.58,5.42,2.36,0.398"], ["--auto-band"]),
    ],
)
def test_what_a_machines_file_states_is_registered_once(
    stated, bearing, two_channels, monkeypatch, srbval_json, srbval_text
):
    """Band, dimensions and orders, by a machine's file or by options; what an option says goes over it."""
    home = two_channels.parent / "home"
    monkeypatch.setenv("SRBVAL_HOME", str(home))
    options = ["--channel", "data[1]", *RECORD[2:8], *bearing, *stated]
    machine = two_channels.parent / "machine.toml"
    wanted = srbval_json("analyse", two_channels, *options, "--write-machine", machine)
    for given in (["--machine", machine], options):
        srbval_text("data", "add", "--repin", two_channels, *given)
        found = srbval_json("analyse", two_channels)
        for key in ("band_hz", "lines", "bearing"):
            assert found[key] == wanted[key]
    assert srbval_json("analyse", two_channels, "--band", "600", "2900")["band_hz"] == [600, 2900]
    said = srbval_text("data", "add", two_channels, "--band", "3000", "500", code=2).err
    assert "band 3000 to 500 Hz" in said
    older = json.loads((home / "manifest.json").read_text(encoding="utf-8"))
    for key in ("band_hz", "auto_band"):
        del older["recordings"][0]["settings"][key]
    (home / "manifest.json").write_text(json.dumps(older), encoding="utf-8")
    srbval_text("data", "list")


def test_a_ball_is_a_rolling_element(two_channels, srbval_json):
    """The field's word for it in a ball bearing."""
    given = [two_channels, "--channel", "data[1]", *RECORD]
    found = [srbval_json("analyse", *given, "--defect", part)["lines"] for part in ("ball", "roller")]
    assert found[0] == found[1]
    assert {line["name"][:5] for line in found[0]} == {"2xBSF"}
    registered = srbval_json("data", "add", two_channels, "--state", "ball")["recordings"]
    assert registered[0]["state"] == "roller"
