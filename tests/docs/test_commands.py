"""Every command of README and documentation runs as printed, page by page, on files like the ones that it names."""

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
from srbval import fault_frequencies, load_bearing, load_campaign, load_scene
from srbval.campaign.cases import plan_cases
from srbval.cli import run_command_line
from srbval.cli.arguments import build_parser
from srbval.storage.installation import shipped_folder
from tests.campaign.campaigns import cluster

DOCS = Path(srbval.__file__).parent / "docs"
README = DOCS.parents[1] / "README.md"
TEXTS = {page.relative_to(DOCS).as_posix(): page.read_text(encoding="utf-8") for page in sorted(DOCS.rglob("*.md"))}
TEXTS[README.name] = README.read_text(encoding="utf-8")
LEFT_OUT = {  # words of commands that are not run here, with the reason
    "pip install": "installs: .ci/run and .ci/release do it",
    "python3 -m venv": "installs",
    "doctor": "of the environment that the line before installed",
    "activate": "the environment of a cluster",
    "sphinx-build": ".ci/run reads the same pages",
    "srbval check": "takes minutes, or replaces the reference: .ci/run does it",
    "srbval evidence": "takes minutes: tests/studies",
    "srbval bench": "takes minutes: tests/studies",
    "srbval stability": "takes minutes: tests/studies",
    "data fetch": "needs a network",
    "--scheduler": "needs a cluster: below",
    "speeds": "of that campaign: below",
    "dask ": "a cluster's",
}
MAIN_JOB = "srbval report"  # takes minutes: tests/report makes it of shorter runs
ITS_PAGE = "guide/own_report.md"  # on other pages reports on recordings are written in the long form alone
ABSOLUTE = "/measurements"  # parent of the guide's folder
FS_HZ, SECONDS, RPM = 25_600, 4.0, 1480.0  # as in the guide's options
ALL = os.environ.get("SRBVAL_TESTS") == "all"
SHORTER = ["--seconds", "1"]  # of a simulation whose page does not state its length, in the short form


def blocks(page: str, kind: str) -> list[str]:
    return re.findall(rf"```{kind}\n(.*?)\n```", TEXTS[page], flags=re.DOTALL)


def commands_of(block: str) -> list[str]:
    """List the commands of a block, without comments, continued lines joined."""
    return [found for line in block.replace("\\\n", " ").splitlines() if (found := re.split(r"\s#", line)[0].strip())]


def commands(page: str) -> list[str]:
    return [command for block in blocks(page, "sh") for command in commands_of(block)]


def is_run(command: str) -> bool:
    return command != MAIN_JOB and not any(words in command for words in LEFT_OUT)


OWN_MODEL = "guide/your_model.md"
PAGES = [page for page in TEXTS if any(map(is_run, commands(page)))]


def write_csv(path: Path, *, fault: bool) -> None:
    """Outer-race impacts of the guide's own bearing, ringing at 3 kHz, in noise; accelerations in g."""
    time = np.arange(int(SECONDS * FS_HZ)) / FS_HZ
    samples = np.random.default_rng(5 + fault).normal(0, 0.05, time.size)
    if fault:
        since = np.mod(time, 1 / fault_frequencies(path.with_name("my_bearing.toml"), rpm=RPM).bpfo_hz)
        samples += np.exp(-900 * since) * np.sin(2 * np.pi * 3000 * since)
    np.savetxt(path, samples, fmt="%.6g")


@pytest.fixture(scope="module")
def named(tmp_path_factory):
    """Folder of the files that the pages name."""
    folder = tmp_path_factory.mktemp("named")
    elements = next(block for block in blocks("guide/your_bearing.md", "toml") if "[elements]" in block)
    (folder / "my_bearing.toml").write_text(elements, encoding="utf-8")
    (folder / "my_model.py").write_text(blocks(OWN_MODEL, "python")[0], encoding="utf-8")
    for name, fault in (("drive_end", True), ("healthy", False)):
        write_csv(folder / f"{name}.csv", fault=fault)
    seconds = np.arange(0, 3, 1 / 20_480)
    since = np.mod(seconds, 1 / fault_frequencies("skf-22240", rpm=710).bpfo_hz)
    table = np.column_stack([seconds, np.exp(-400 * since) * np.sin(2 * np.pi * 900 * since)])
    np.savetxt(folder / "run_outer.csv", table, delimiter=",", header="time [s],acc [m/s2]", comments="")
    turned = np.column_stack([table, 0.431 * 2 * np.pi * 710 / 60 * seconds])
    np.savetxt(folder / "run.csv", turned, delimiter=",", header="time [s],acc_y [m/s2],cage_angle [rad]", comments="")
    rig = folder / ABSOLUTE.removeprefix("/") / "rig7"
    rig.mkdir(parents=True)
    for name in ("healthy", "run01", "run02"):
        np.save(rig / f"{name}.npy", np.random.default_rng(len(name)).normal(size=40_000))
    labels = re.search(r"```\n(file;.*?)```", TEXTS["guide/your_data.md"], flags=re.DOTALL)
    assert labels is not None
    (folder / "labels.csv").write_text(labels[1].replace(".tdms", ".npy"), encoding="utf-8")
    (folder / "machine.toml").write_text(blocks("guide/your_data.md", "toml")[0], encoding="utf-8")
    (folder / "scene.toml").write_text(blocks("guide/commands.md", "toml")[0], encoding="utf-8")
    return folder


@pytest.fixture
def files(named, tmp_path, monkeypatch, request, _results_of_the_module):
    """Current folder with the files that a page names; the README's recordings are found by their names alone."""
    monkeypatch.chdir(tmp_path)
    excerpts = shipped_folder("data_manifest") / "rig_excerpts"
    for source in (named,) if request.node.callspec.params["page"] == README.name else (named, excerpts):
        shutil.copytree(source, tmp_path, dirs_exist_ok=True)
    return tmp_path


def run(command: str, folder: Path) -> None:
    words = shlex.split(command.replace(ABSOLUTE, f"{folder}{ABSOLUTE}"))
    assert words[0] == "srbval", f"{command}: neither run nor left out with its reason"
    shorter = SHORTER if words[1] == "simulate" and "--seconds" not in words and not ALL else []
    assert run_command_line([*words[1:], *shorter]) == 0, command


@pytest.mark.parametrize("page", PAGES)
def test_every_command_runs_as_it_is_printed(page, files, capsys):
    """Its output begins as the page shows; lines may be shortened at their ends."""
    printed = list[str]()
    for kind, block in re.findall(r"```(sh|none)\n(.*?)\n```", TEXTS[page], flags=re.DOTALL):
        if kind == "none":
            assert all(any(line.startswith(shown) for line in printed) for shown in block.splitlines()), block
            continue
        for command in filter(is_run, commands_of(block)):
            if not command.startswith(MAIN_JOB) or page == ITS_PAGE or ALL:
                run(command, files)
        printed = capsys.readouterr().out.splitlines()


@pytest.mark.parametrize("page", TEXTS)
def test_every_command_has_the_options_it_is_given(page):
    """Includes commands that are not run, and complete ones within a sentence."""
    within = re.findall(r"`(srbval [a-z][^`]*)`", re.sub(r"```.*?```", "", TEXTS[page], flags=re.DOTALL))
    for line in [c for c in commands(page) if c.startswith("srbval ")] + [c for c in within if " -" in c]:
        words = shlex.split(line.replace("...", ""))
        assert build_parser().parse_args(words[1:]).command == words[1], line


def test_the_guides_own_bearings_are_bearings_and_its_scenes_scenes(tmp_path):
    for block in blocks("guide/your_bearing.md", "toml"):
        path = tmp_path / "own.toml"
        path.write_text(block, encoding="utf-8")
        if block.startswith("title"):
            assert load_bearing(path).rolling_elements > 1
        else:
            assert load_scene(path).duration_s > 0
    path.write_text(blocks("guide/commands.md", "toml")[1], encoding="utf-8")
    assert not any(case.refused for case in plan_cases(load_campaign(str(path))))


@pytest.mark.long_form
@pytest.mark.usefixtures("_results_of_the_module")
def test_the_guides_own_model_runs_in_an_empty_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    Path("my_model.py").write_text(blocks(OWN_MODEL, "python")[0], encoding="utf-8")
    for command in commands(OWN_MODEL):
        run(command, tmp_path)
    assert re.search(r"takes \S+ times .* the CPU of imex2 at the same step", capsys.readouterr().out)
    drawn = {"srbval-bench.svg", "srbval-bench.csv", "srbval-stability.svg", "srbval-stability.csv"}
    assert {path.name for path in tmp_path.iterdir()} == {"my_model.py", "run.h5"} | drawn


@pytest.mark.slow
@pytest.mark.long_form
@pytest.mark.parametrize("engine", ["slurm", "scheduler"])
def test_the_campaign_on_a_cluster_goes_word_for_word(engine, tmp_path):
    """A stand-in replaces SLURM; interface, address and number of jobs are this machine's."""
    environment = os.environ | {"DASK_CONFIG": str(tmp_path)}
    page = "guide/many_cases.md"
    for name in ("speeds.toml", "jobqueue.yaml"):
        (tmp_path / name).write_text(blocks(page, name[-4:])[0].replace("ib0", "lo"), encoding="utf-8")
    with cluster(engine, tmp_path, environment) as options:
        for line in commands(page):
            other = {"slurm": "--scheduler", "scheduler": "--cluster-class"}[engine]
            if " speeds" in line and other not in line:
                own = line.replace("tcp://10.0.0.5:8786", options[-1]).replace("--jobs 8", "--jobs 2")
                subprocess.run([sys.executable, "-m", *shlex.split(own)], cwd=tmp_path, env=environment, check=True)
    table = (tmp_path / "speeds" / "results.csv").read_text(encoding="utf-8").splitlines()
    assert {row.split(",")[0] for row in table[1:] if ",ok," in row} == set("012345678")
