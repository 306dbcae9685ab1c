"""Whatever is killed, and whenever: the same command comes to the same results, and nothing is left behind."""

import os
import random
import signal
import subprocess
import time
from pathlib import Path

import pytest

from tests.campaign.campaigns import content
from tests.campaign.command import MANY, cluster, start
from tests.marked import listening, marked, reachable, until

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
KILLS = int(os.environ.get("SRBVAL_KILLS", "2"))
LONGEST_START_S = 1.5  # within which every second campaign is killed, its imports included
GONE_S = 60.0  # for all processes to end; a worker of a lost SLURM scheduler gives up after `DEATH_TIMEOUT_S`
ENGINES = [
    "local",
    pytest.param("dask", marks=pytest.mark.long_form),
    pytest.param("slurm", marks=pytest.mark.long_form),
]
ALL, OWN, WORKER = "the whole group", "the campaign's process", "a worker"
KINDS = [
    (ALL, signal.SIGKILL),
    (WORKER, signal.SIGKILL),
    (OWN, signal.SIGINT),
    (OWN, signal.SIGKILL),
    (ALL, signal.SIGINT),
    (OWN, signal.SIGTERM),
]
WORKERS = ("campaign.worker", "spawn_main")  # those of this machine, and what Dask's nannies start
RESULT = "cases/*.h5"


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Results of a campaign that nobody disturbs."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "many.toml").write_text(MANY)
    assert start(folder / "many.toml", folder / "run").wait() == 0
    return content(folder / "run")


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.timeout(120 + 60 * KILLS)
def test_killed_at_random_moments(engine: str, undisturbed: dict[str, str], tmp_path: Path) -> None:
    chance = random.Random(engine)
    file = tmp_path / "many.toml"
    file.write_text(MANY)
    mark = {"SRBVAL_TEST": str(tmp_path)}
    environment = dict(mark)
    killed: list[str] = []
    with cluster(engine, tmp_path, environment) as options:
        campaign = 0
        while len(killed) < KILLS:
            folder = tmp_path / f"run-{campaign}"
            target, how = KINDS[len(killed) % len(KINDS)]
            process = start(file, folder, *options, stderr=subprocess.PIPE, environment=environment)
            early = chance.random() < 0.5
            if not early:
                _wait_for_a_result(folder, process)
            time.sleep(chance.uniform(0, LONGEST_START_S))
            _assert_ports(engine, process.pid)
            if process.poll() is None and _kill(target, how, process, mark, chance):
                killed.append(f"{how.name} to {target}, {'early' if early else 'late'}")
            if target == WORKER:
                _assert_goes_on(process, engine)
                campaign += _finished(process, folder, undisturbed)
            said = process.communicate()[1].decode()
            # Python itself has no answer to Ctrl-C while it starts.
            starting = early and how is signal.SIGINT and "numpy" not in said and "campaign" not in said
            assert "Traceback" not in said or starting, said
            assert starting or sum(not line.startswith("campaign many") for line in said.splitlines()) <= 1, said
            if process.returncode == 0 and target != WORKER:
                campaign += _finished(process, folder, undisturbed)
        folder = tmp_path / f"run-{campaign}"
        assert start(file, folder, *options, environment=environment).wait() == 0
        assert content(folder) == undisturbed
        assert not list(tmp_path.rglob("*.srbval-part"))
    until(lambda: not marked(mark), within_s=GONE_S)
    assert len(killed) == KILLS
    print(f"{engine}: {KILLS} kills, {campaign} campaigns ended before: {killed}")


def _wait_for_a_result(folder: Path, process: subprocess.Popen[bytes]) -> None:
    before = len(list(folder.glob(RESULT)))
    until(lambda: process.poll() is not None or len(list(folder.glob(RESULT))) > before)


def _assert_ports(engine: str, campaign: int) -> None:
    """Only SLURM's jobs must reach this machine: at the scheduler's port."""
    pids = [campaign, *_descendants(campaign)]
    if engine == "slurm":
        assert len({port for _, port in reachable(campaign)}) <= 1
    else:
        assert not [address for pid in pids for address in listening(pid)]


def _kill(
    target: str, how: signal.Signals, process: subprocess.Popen[bytes], mark: dict[str, str], chance: random.Random
) -> bool:
    """Send the signal; whether there was somebody to get it."""
    try:
        if target == ALL:
            os.killpg(process.pid, how)
        elif target == OWN:
            process.send_signal(how)
        else:
            workers = [pid for pid, command in marked(mark).items() if any(name in command for name in WORKERS)]
            os.kill(chance.choice(workers), how)
    except (ProcessLookupError, IndexError):
        return False
    return True


def _assert_goes_on(process: subprocess.Popen[bytes], engine: str) -> None:
    """A worker's end is not the campaign's, unless SLURM has lost all its jobs."""
    code = process.wait()
    assert code == 0 or (engine == "slurm" and code == 3)


def _finished(process: subprocess.Popen[bytes], folder: Path, undisturbed: dict[str, str]) -> bool:
    if process.returncode == 0:
        assert content(folder) == undisturbed, sorted(folder.rglob("*"))
    return process.returncode == 0


def _descendants(pid: int) -> list[int]:
    found = subprocess.run(["ps", "-o", "pid=", "--ppid", str(pid)], capture_output=True, text=True, check=False)
    children = [int(text) for text in found.stdout.split()]
    return [*children, *(below for child in children for below in _descendants(child))]
