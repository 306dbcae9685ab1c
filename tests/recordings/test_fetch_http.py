"""Download of an open set over HTTP, from a server of the test's own: broken off, resumed, wrong, complete."""

import dataclasses
import hashlib
import threading
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest

from srbval.errors import ConfigurationError, DataError
from srbval.recordings.datasets.description import ExpectedFile, dataset
from srbval.recordings.registry import FileStatus, fetch, register

from . import files

NAMES = ("H_877rpm_a.mat", "IR_877rpm_a.mat", "OR_877rpm_a.mat")


class Server(ThreadingHTTPServer):
    """Serves `contents`; `broken` names are cut half-way, `asked` lists the requests."""

    def __init__(self, contents):
        super().__init__(("127.0.0.1", 0), Handler)
        self.contents, self.broken, self.asked = contents, set(), []
        self.url = f"http://127.0.0.1:{self.server_port}"
        threading.Thread(target=self.serve_forever, daemon=True).start()


class Handler(BaseHTTPRequestHandler):
    def do_GET(self):
        name = self.path.lstrip("/")
        self.server.asked.append(name)
        body = self.server.contents[name]
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body[: len(body) // 2] if name in self.server.broken else body)

    def log_message(self, *_):
        """Keep the test's output clean."""


@pytest.fixture
def server(tmp_path, monkeypatch):
    (tmp_path / "made").mkdir()
    made = (files.excerpt(tmp_path / "made" / name, condition=name.split("_")[0]) for name in NAMES)
    served = Server({path.name: path.read_bytes() for path in made})
    expected = (
        ExpectedFile(name=name, sha256=hashlib.sha256(body).hexdigest(), url=f"{served.url}/{name}")
        for name, body in served.contents.items()
    )
    described = dataclasses.replace(dataset("torino-excerpts"), files=tuple(expected))
    monkeypatch.setattr(register, "dataset", lambda _: described)
    yield served
    served.shutdown()
    served.server_close()


def test_what_cannot_be_fetched_and_the_way_out(tmp_path, monkeypatch):
    def no_network(**_):
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


def test_broken_off_then_resumed_at_the_file_that_is_missing(server, tmp_path):
    server.broken = {NAMES[1]}
    with pytest.raises(DataError, match=rf"{NAMES[1]} could not be downloaded.*data add"):
        fetch("torino-excerpts", tmp_path / "data")
    assert [p.name for p in (tmp_path / "data").iterdir()] == [NAMES[0]]  # no half a file
    server.broken, reported = set(), []
    result = fetch("torino-excerpts", tmp_path / "data", progress=lambda *call: reported.append(call))
    assert [(Path(r.file).name, r.status) for r in result.recordings] == [(name, FileStatus.OK) for name in NAMES]
    assert reported == [("Download", part / 3) for part in range(4)]
    assert server.asked.count(NAMES[0]) == 1  # what was there was kept


def test_file_that_is_not_the_pinned_one_is_refused(server, tmp_path):
    body = bytearray(server.contents[NAMES[0]])
    body[5000] ^= 1
    server.contents[NAMES[0]] = bytes(body)
    with pytest.raises(DataError, match="hash"):
        fetch("torino-excerpts", tmp_path / "data")
    assert not list((tmp_path / "data").iterdir())
