"""Shared fixtures: the folder of measured recordings, and a home folder for every test."""

import json
import os
import pickle
import signal
from pathlib import Path
from typing import Any

import pytest

from srbval.cli import LIBRARY_THREADS, run_command_line
from srbval.models.jit import precompile
from srbval.models.solvers import METHODS
from srbval.processes.machine import usable_cores
from srbval.scene import load_scene, paper_scene

REPORT = "tests/report"


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels before the workers start, so that no two of them compile the same."""
    if not hasattr(session.config, "workerinput") and session.config.getoption("numprocesses", None):
        # The workers use all cores already; without bytecode, every process would compile each module it imports.
        os.environ |= dict.fromkeys(LIBRARY_THREADS, "1") | {"PYTHONDONTWRITEBYTECODE": ""}
        paper = [*(paper_scene(solver={"name": name}) for name in METHODS), paper_scene(model="planar")]
        precompile(*paper, load_scene("rig"), load_scene("rig-oil"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark the suite of verification; skip the long form (see `contributing.md`) unless `SRBVAL_TESTS=all`."""
    short = os.environ.get("SRBVAL_TESTS") != "all"
    for item in items:
        if "verification" in item.path.parts:
            item.add_marker(pytest.mark.verification)
        if short and item.get_closest_marker("long_form"):
            item.add_marker(pytest.mark.skip(reason="of the long form: SRBVAL_TESTS=all"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """One worker more than cores: about a fifth of the time is spent waiting for other processes to start or end."""
    return usable_cores() + 1


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Run the tests of a file, and all tests of the report, in one worker: they share results.

    `--dist` is ignored: under pytest 9 the groups of `loadgroup` do not reach the scheduler (xdist 3.8). Files are
    distributed in their order, so that the planted errors, which use threads, come last.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return REPORT if nodeid.startswith(f"{REPORT}/") else nodeid.partition("::")[0]

        def remove_node(self, node: Any) -> Any:
            """Give only the unfinished files of a crashed worker to others: finished ones would never be answered."""
            of_node = self.assigned_work[node]
            self.assigned_work[node] = {file: tests for file, tests in of_node.items() if not all(tests.values())}
            return super().remove_node(node)

    config.option.loadscopereorder = False
    return ByFile(config, log)


@pytest.fixture(scope="session")
def recordings_dir():
    """Folder of measured recordings, from SRBVAL_RECORDINGS; skips if it is not set."""
    folder = os.environ.get("SRBVAL_RECORDINGS")
    if not folder or not Path(folder).is_dir():
        pytest.skip("SRBVAL_RECORDINGS does not name a folder of measured recordings")
    return Path(folder)


@pytest.fixture
def srbval_text(capsys):
    """Run a command line that ends with the exit code `code`; returns what it printed, `out` and `err`."""

    def run(*words, code=0):
        capsys.readouterr()
        assert run_command_line([str(word) for word in words]) == code
        return capsys.readouterr()

    return run


@pytest.fixture
def srbval_json(srbval_text):
    """Run a command line with --json; returns the document, which has neither NaN nor Infinity."""

    def run(*words, code=0):
        text = srbval_text(*words, "--json", code=code).out
        return json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} in JSON"))

    return run


@pytest.fixture(autouse=True)
def _signals_are_a_user_s():
    """Restore the default signal handlers, which tests, dask-jobqueue, nohup or a background shell change."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGINT, signal.default_int_handler)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)


@pytest.fixture(autouse=True)
def _bugs_are_seen(monkeypatch):
    """Let unexpected errors of the command line raise, since they are bugs."""

    def raise_it(error: BaseException) -> str:
        raise error

    monkeypatch.setattr("srbval.cli.internal_error", raise_it)


@pytest.fixture(autouse=True)
def _records_are_read_in_this_process(monkeypatch):
    """Read without starting processes, which takes longer; pickle as they do. `test_analyse_command` starts them."""
    here, sent = "srbval.monitoring.batch.in_processes", lambda value: pickle.loads(pickle.dumps(value))
    monkeypatch.setattr(here, lambda function, items, **_: ((one, sent(function(sent(one)))) for one in items))


@pytest.fixture(autouse=True)
def _own_home(tmp_path_factory, monkeypatch):
    """Keep the user's register and recordings out of the tests, and the tests out of the user's register."""
    monkeypatch.delenv("SRBVAL_RECORDINGS", raising=False)
    home = tmp_path_factory.mktemp("home")
    monkeypatch.setenv("SRBVAL_HOME", str(home))
    monkeypatch.setattr("srbval.storage.content_store.cache_folder", lambda kind: home / kind)


@pytest.fixture(scope="module")
def _own_results(tmp_path_factory):
    """Store what is computed for all tests of a module apart from the user's results."""
    folder = tmp_path_factory.mktemp("results")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("srbval.storage.content_store.cache_folder", lambda _: folder)
        yield folder


@pytest.fixture
def _results_of_the_module(_own_home, _own_results, monkeypatch):
    """Let a test read what earlier tests of its module stored."""
    monkeypatch.setattr("srbval.storage.content_store.cache_folder", lambda kind: _own_results / kind)


@pytest.fixture(autouse=True, scope="session")
def _nothing_shipped():
    """Hide the shipped excerpts of the rig; their own tests show them again."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("srbval.recordings.registry.shipped_recordings", lambda: ())
        yield
