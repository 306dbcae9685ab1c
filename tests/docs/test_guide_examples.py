"""The guide's examples, word for word: every command is one, and those for one's own files run on such files."""

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import srbval
from srbval.bearing import fault_frequencies, load_bearing
from srbval.cli import main
from srbval.cli.arguments import parser
from srbval.scene import load_scene
from srbval.storage.installation import shipped_folder
from tests.campaign.command import cluster

GUIDE = Path(srbval.__file__).parent / "docs" / "guide"
TEXTS = {page.stem: page.read_text(encoding="utf-8") for page in sorted(GUIDE.glob("*.md"))}
FS_HZ, SECONDS, RPM = 25_600, 4.0, 1480.0  # as the guide's options say


def examples(page: str) -> list[str]:
    """The commands of a page, without comments, continued lines joined."""
    blocks = "\n".join(re.findall(r"```sh\n(.*?)```", TEXTS[page], flags=re.DOTALL)).replace("\\\n", " ")
    return [line.split(" #")[0].strip() for line in blocks.splitlines() if line.startswith("srbval ")]


@pytest.mark.parametrize("line", sorted({line for page in TEXTS for line in examples(page)}))
def test_every_command_of_the_guide_has_the_options_it_is_given(line: str) -> None:
    assert parser().parse_args(shlex.split(line)[1:]).command == line.split()[1]


def write_csv(path: Path, *, fault: bool) -> None:
    """Outer-race blows of the guide's own bearing, ringing at 3 kHz, in noise; accelerations in g."""
    time = np.arange(int(SECONDS * FS_HZ)) / FS_HZ
    samples = np.random.default_rng(5 + fault).normal(0, 0.05, time.size)
    if fault:
        since = np.mod(time, 1 / fault_frequencies("my_bearing.toml", rpm=RPM).bpfo_hz)
        samples += np.exp(-900 * since) * np.sin(2 * np.pi * 3000 * since)
    np.savetxt(path, samples, fmt="%.6g")


@pytest.fixture
def own_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The files that the guide names: its bearing, a record of it and a healthy one."""
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```toml\n(.*?)```", TEXTS["your_bearing"], flags=re.DOTALL)
    elements = next(block for block in blocks if "[elements]" in block)
    Path("my_bearing.toml").write_text(elements, encoding="utf-8")
    write_csv(Path("drive_end.csv"), fault=True)
    write_csv(Path("healthy.csv"), fault=False)
    return tmp_path


def test_the_guides_own_bearings_are_bearings_and_its_scenes_scenes(tmp_path: Path) -> None:
    for block in re.findall(r"```toml\n(.*?)```", TEXTS["your_bearing"], flags=re.DOTALL):
        path = tmp_path / "own.toml"
        path.write_text(block, encoding="utf-8")
        if block.startswith("title"):
            assert load_bearing(path).rolling_elements > 1
        else:
            assert load_scene(path).duration_s > 0


@pytest.mark.usefixtures("own_files")
def test_the_guides_own_recording_is_analysed(capsys: pytest.CaptureFixture[str]) -> None:
    (line,) = (line for line in examples("your_data") if line.startswith("srbval analyse drive_end.csv"))
    assert main(shlex.split(line)[1:]) == 0
    assert "BPFO (outer race) line detected" in capsys.readouterr().out


def test_the_guides_report_calls_the_fault(own_files: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (line,) = (line for line in examples("own_report") if "--healthy" in line)
    assert main(shlex.split(line)[1:]) == 0, capsys.readouterr().err
    page = (own_files / "srbval-report-drive_end" / "report.html").read_text(encoding="utf-8")
    assert "Outer race fault: the BPFO line stands" in page
    assert "The band was chosen on the record itself" in page
    assert (own_files / "srbval-report-drive_end" / "report.pdf").stat().st_size > 0


def test_the_tutorials_output_is_what_its_commands_print(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(shipped_folder("data_manifest") / "rig_excerpts", tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    blocks = re.findall(r"```(sh|none)\n(.*?)\n```", TEXTS["tutorial"], flags=re.DOTALL)
    shown, printed = 0, ""
    for kind, block in blocks:
        if kind == "sh" and not block.startswith("srbval report"):
            assert main(shlex.split(block)[1:]) == 0, block
            printed = capsys.readouterr().out
        elif kind == "none":
            assert set(block.splitlines()) <= set(printed.splitlines()), block
            shown += 1
    assert shown == 4
    assert (tmp_path / "answer.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["slurm", pytest.param("dask", marks=pytest.mark.long_form)])
def test_the_campaign_on_a_cluster_goes_word_for_word(engine: str, tmp_path: Path) -> None:
    """With a stand-in for SLURM; interface, address and number of jobs are this machine's."""
    environment = os.environ | {"DASK_CONFIG": str(tmp_path)}
    for name in ("speeds.toml", "jobqueue.yaml"):
        _, _, block = TEXTS["many_cases"].partition(f"```{name[-4:]}\n")
        (tmp_path / name).write_text(block.partition("```")[0].replace("ib0", "lo"), encoding="utf-8")
    with cluster(engine, tmp_path, environment) as options:
        for line in examples("many_cases"):
            if " speeds" in line and ("--engine" not in line or engine in line):
                own = line.replace("tcp://10.0.0.5:8786", options[-1]).replace("--jobs 8", "--jobs 2")
                subprocess.run([sys.executable, "-m", *shlex.split(own)], cwd=tmp_path, env=environment, check=True)
    table = (tmp_path / "speeds" / "results.csv").read_text(encoding="utf-8").splitlines()
    assert {row.split(",")[0] for row in table[1:] if ",ok," in row} == set("012345678")
