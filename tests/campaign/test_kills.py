"""Whatever is killed, and whenever: the same command comes to the same results, and nothing is left behind."""

import contextlib
import os
import random
import re
import signal
import subprocess
import time

import pytest

from srbval.campaign.run import load_campaign
from tests.campaign.campaigns import MANY, cluster, content, run_small, start
from tests.marked import listening, marked, reachable, until

pytestmark = pytest.mark.skipif(not hasattr(os, "killpg"), reason="no process groups here")
KILLS = int(os.environ.get("SRBVAL_KILLS", "2"))
LONGEST_START_S = 1.5  # within which every second campaign is killed, its imports included
GONE_S = 60.0  # for all processes to end; a worker of a lost SLURM scheduler gives up after `DEATH_TIMEOUT_S`
CLUSTERS = [pytest.param(name, marks=pytest.mark.long_form) for name in ("dask", "scheduler", "slurm")]
ALL, OWN, WORKER = "the whole group", "the campaign's process", "a worker"
KINDS = [  # of which a short test takes the first two
    (ALL, signal.SIGKILL),
    (ALL, signal.SIGINT),  # as a terminal does
    (WORKER, signal.SIGKILL),
    (OWN, signal.SIGINT),
    (OWN, signal.SIGKILL),
    (OWN, signal.SIGTERM),
]
CTRL_C = 1  # number of the campaign that is interrupted right after its first result
WORKERS = ("campaign.worker", "spawn_main")  # those of this machine, and what Dask's nannies start
RESULT = "cases/*.h5"


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Results of a campaign that nobody disturbs."""
    folder = tmp_path_factory.mktemp("undisturbed")
    (folder / "many.toml").write_text(MANY)
    run_small(load_campaign(str(folder / "many.toml")), folder / "run")
    return content(folder / "run")


@pytest.mark.parametrize("engine", ["local", *CLUSTERS])
@pytest.mark.timeout(120 + 60 * KILLS)
def test_killed_at_random_moments(engine, undisturbed, tmp_path):
    chance, file = random.Random(engine), tmp_path / "many.toml"
    file.write_text(MANY)
    mark = {"SRBVAL_TEST": str(tmp_path)}
    environment = dict(mark)
    with cluster(engine, tmp_path, environment) as options:
        for number in range(KILLS):
            folder, (target, how) = tmp_path / f"run-{number}", KINDS[number % len(KINDS)]
            process = start(file, folder, *options, stderr=subprocess.PIPE, environment=environment)
            at_once, early = number == CTRL_C, number != CTRL_C and chance.random() < 0.5
            if not early:
                _wait_for_a_result(folder, process)
            time.sleep(0.0 if at_once else chance.uniform(0, LONGEST_START_S))
            _assert_ports(engine, process.pid)
            with contextlib.suppress(ProcessLookupError, IndexError):  # it has ended already
                _kill(target, how, process.pid, mark, chance)
            said = process.communicate()[1].decode()
            # Python itself has no answer to Ctrl-C while it starts.
            starting = early and how is signal.SIGINT and "numpy" not in said and "campaign" not in said
            assert "Traceback" not in said or starting, said
            # Of a killed process, Python's own helper of a LocalCluster says what it cleans up.
            messages = [line for line in said.splitlines() if not re.search("campaign many|resource_tracker", line)]
            assert starting or len([line for line in messages if "warnings.warn(" not in line]) <= 1, said
            if at_once and engine != "slurm":
                assert process.returncode == 130
                assert "interrupted; no incomplete file was left" in said
                assert not list(folder.rglob("*.srbval-part"))
            # A worker's end is not the campaign's, unless SLURM has lost all its jobs.
            assert target != WORKER or process.returncode in ((0, 3) if engine == "slurm" else (0,)), said
            if engine == "local":  # the command would start three processes
                kept = len(list(folder.glob(RESULT)))
                found = run_small(load_campaign(str(file)), folder)
                assert (found["done"], found["ran"], found["failed"]) == (12, 12 - kept, [])
            else:
                assert start(file, folder, *options, environment=environment).wait() == 0
            assert content(folder) == undisturbed
        assert not list(tmp_path.rglob("*.srbval-part"))
    until(lambda: not marked(mark), within_s=GONE_S)


def _wait_for_a_result(folder, process):
    before = len(list(folder.glob(RESULT)))
    until(lambda: process.poll() is not None or len(list(folder.glob(RESULT))) > before)


def _assert_ports(engine, campaign):
    """Only SLURM's jobs must reach this machine, at the scheduler's port; a cluster of this machine reaches itself."""
    children = pytest.importorskip("psutil").Process(campaign).children(recursive=True)
    if engine == "slurm":
        assert len({port for _, port in reachable(campaign)}) <= 1
    else:
        ports = reachable if engine == "dask" else listening
        assert not [address for pid in (campaign, *(child.pid for child in children)) for address in ports(pid)]


def _kill(target, how, campaign, mark, chance):
    if target == ALL:
        os.killpg(campaign, how)
    elif target == OWN:
        os.kill(campaign, how)
    else:
        os.kill(chance.choice([pid for pid, words in marked(mark).items() if any(w in words for w in WORKERS)]), how)
