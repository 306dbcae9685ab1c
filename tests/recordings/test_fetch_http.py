"""Download of an open set over HTTP, from a server of the test's own: broken off, resumed, wrong, complete."""

import dataclasses
import hashlib
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from srbval.errors import ConfigurationError, DataError
from srbval.recordings.datasets.description import ExpectedFile, dataset
from srbval.recordings.registry import FileStatus, fetch, register

from . import files

NAMES = ("H_877rpm_a.mat", "IR_877rpm_a.mat", "OR_877rpm_a.mat")


class Server:
    """Serves `files`; `broken` names are cut half-way, `asked` counts requests."""

    def __init__(self, contents: dict[str, bytes]) -> None:
        self.contents, self.broken, self.asked = contents, set[str](), list[str]()
        outer = self

        class Handler(BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                name = self.path.lstrip("/")
                outer.asked.append(name)
                body = outer.contents[name]
                self.send_response(200)
                self.send_header("Content-Length", str(len(body)))
                self.end_headers()
                self.wfile.write(body[: len(body) // 2] if name in outer.broken else body)

            def log_message(self, *_: object) -> None:
                """Keep the test's output clean."""

        self.http = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.http.server_port}"
        threading.Thread(target=self.http.serve_forever, daemon=True).start()


@pytest.fixture
def server(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Server]:
    (tmp_path / "made").mkdir()
    contents = {
        name: files.excerpt(tmp_path / "made" / name, condition=name.split("_")[0]).read_bytes() for name in NAMES
    }
    served = Server(contents)
    described = dataclasses.replace(
        dataset("torino-excerpts"),
        files=tuple(
            ExpectedFile(name=name, sha256=hashlib.sha256(body).hexdigest(), url=f"{served.url}/{name}")
            for name, body in contents.items()
        ),
    )
    monkeypatch.setattr(register, "dataset", lambda _: described)
    yield served
    served.http.shutdown()
    served.http.server_close()


def test_what_cannot_be_fetched_and_the_way_out(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def no_network(**_: object) -> None:
        raise OSError("network is unreachable")

    monkeypatch.setattr("pooch.retrieve", no_network)
    with pytest.raises(DataError, match=r"network is unreachable.*data add"):
        fetch("torino-excerpts", tmp_path)
    with pytest.raises(DataError, match=r"restricted.*data add"):
        fetch("torino-full")
    with pytest.raises(DataError, match=r"no pinned files.*Downloadable: torino-excerpts"):
        fetch("upm-citef")
    with pytest.raises(ConfigurationError, match="Known: cwru"):
        fetch("nothing")


@pytest.mark.usefixtures("server")
def test_all_files_with_progress_and_registered(tmp_path: Path) -> None:
    reported: list[tuple[str, float | None]] = []
    result = fetch("torino-excerpts", tmp_path / "data", progress=lambda *call: reported.append(call))
    assert [r.status for r in result.recordings] == [FileStatus.OK] * 3
    assert [Path(r.file).name for r in result.recordings] == list(NAMES)
    assert reported == [("Download", part / 3) for part in range(4)]


def test_broken_off_then_resumed_at_the_file_that_is_missing(server: Server, tmp_path: Path) -> None:
    server.broken = {NAMES[1]}
    with pytest.raises(DataError, match=rf"{NAMES[1]} could not be downloaded.*data add"):
        fetch("torino-excerpts", tmp_path / "data")
    assert [p.name for p in (tmp_path / "data").iterdir()] == [NAMES[0]]  # no half a file
    server.broken = set()
    result = fetch("torino-excerpts", tmp_path / "data")
    assert [r.status for r in result.recordings] == [FileStatus.OK] * 3
    assert server.asked.count(NAMES[0]) == 1  # what was there was kept


def test_file_that_is_not_the_pinned_one_is_refused(server: Server, tmp_path: Path) -> None:
    body = bytearray(server.contents[NAMES[0]])
    body[5000] ^= 1
    server.contents[NAMES[0]] = bytes(body)
    with pytest.raises(DataError, match="hash"):
        fetch("torino-excerpts", tmp_path / "data")
    assert not list((tmp_path / "data").iterdir())
