"""Shared fixtures: where the measured recordings are, and a home of its own for every test."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from srbval.models.jit import precompile
from srbval.models.solvers import SOLVERS
from srbval.scene import load_scene, paper_scene

REPORT = "tests/report"


def pytest_sessionstart(session: pytest.Session) -> None:
    """Compile the kernels before there are workers: two of them would do it twice."""
    if not hasattr(session.config, "workerinput") and session.config.getoption("numprocesses", None):
        scenes = [paper_scene(model=model, solver={"name": name}) for model in ("full", "slices") for name in SOLVERS]
        precompile(*scenes, paper_scene(model="line"), paper_scene(model="planar"), load_scene("rig"))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out the long form, see `contributing.md`, unless it is asked for."""
    if os.environ.get("SRBVAL_TESTS") != "all":
        for item in items:
            if item.get_closest_marker("long_form"):
                item.add_marker(pytest.mark.skip(reason="of the long form: SRBVAL_TESTS=all"))


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """Keep the tests of a file, and all that look at one report, with one worker: they share what was made for it.

    Whatever `--dist` says: under pytest 9 the groups of `loadgroup` no longer reach its scheduler (xdist 3.8). Files
    are handed out in their order, which leaves the planted errors, with threads of their own, for the end.
    """
    from xdist.scheduler import LoadScopeScheduling

    class ByFile(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = nodeid.split("::", 1)[0]
            return REPORT if file.startswith(f"{REPORT}/") else file

        def remove_node(self, node: Any) -> Any:
            """Of a worker that crashed, only what it left is handed on: files done wait for an answer for ever."""
            of_node = self.assigned_work[node]
            self.assigned_work[node] = {file: tests for file, tests in of_node.items() if not all(tests.values())}
            return super().remove_node(node)

    config.option.loadscopereorder = False
    return ByFile(config, log)


@pytest.fixture(scope="session")
def recordings_dir() -> Path:
    """Folder of measured recordings, from SRBVAL_RECORDINGS; skips visibly where it is not set."""
    folder = os.environ.get("SRBVAL_RECORDINGS")
    if not folder or not Path(folder).is_dir():
        pytest.skip("SRBVAL_RECORDINGS does not name a folder of measured recordings")
    return Path(folder)


@pytest.fixture(autouse=True)
def _signals_are_a_user_s() -> Iterator[None]:
    """Whoever imports dask-jobqueue, or runs the tests in a shell's background or by nohup, has others than a user."""
    signal.signal(signal.SIGINT, signal.default_int_handler)
    if hasattr(signal, "SIGHUP"):
        signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.fixture(autouse=True)
def _bugs_are_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    """An error that nobody expected is a bug: in tests the command line does not make a message of it."""

    def raise_it(error: BaseException) -> str:
        raise error

    monkeypatch.setattr("srbval.cli.internal_error", raise_it)


@pytest.fixture(autouse=True)
def _own_home(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the user's manifest and recordings out of the tests, and the tests out of the user's manifest."""
    monkeypatch.delenv("SRBVAL_RECORDINGS", raising=False)
    home = tmp_path_factory.mktemp("home")
    monkeypatch.setenv("SRBVAL_HOME", str(home))
    monkeypatch.setattr("srbval.storage.content_store.cache_folder", lambda kind: home / kind)


@pytest.fixture(autouse=True, scope="session")
def _nothing_shipped() -> Iterator[None]:
    """Without the rig's excerpts that come with the program: their own tests bring them back."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("srbval.recordings.registry.lookup.shipped_recordings", lambda: ())
        yield
