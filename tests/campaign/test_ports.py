"""What a campaign opens to other machines: nothing, but a SLURM cluster's own ports, and what was asked for."""

from __future__ import annotations

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from srbval.campaign.engines import choose_engine
from srbval.campaign.run import run_campaign
from srbval.errors import ConfigurationError
from tests.campaign.command import MANY, cluster, start
from tests.campaign.scheduler import running_scheduler
from tests.campaign.small import content, small
from tests.marked import listening, marked, reachable, until

JOBS = ("dask_worker", "spawn_main")


@pytest.fixture
def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port: int = server.getsockname()[1]
    return port


@pytest.fixture
def running(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[tuple[int, dict[str, str]]]:
    """A campaign on the stand-in for SLURM, with the test's own options: its number, and the mark of its processes."""
    file, mark = tmp_path / "many.toml", {"SRBVAL_TEST": str(tmp_path)}
    file.write_text(MANY.replace("60 ms", "2 s"))
    environment = dict(mark)
    with cluster("slurm", tmp_path, environment) as options:
        more = getattr(request, "param", ())
        if more:
            more = ("--dashboard", f"127.0.0.1:{request.getfixturevalue('free_port')}")
        process = start(file, tmp_path / "run", *options, *more, environment=environment)
        until(lambda: "engines.worker" in " ".join(marked(mark).values()) or process.poll() is not None)
        yield process.pid, mark
        process.terminate()
        process.wait()
        for pid in marked(mark):
            os.kill(pid, 9)


@pytest.mark.slow
def test_slurm_opens_the_schedulers_port_and_those_of_its_workers(running: tuple[int, dict[str, str]]) -> None:
    pid, mark = running
    assert len({port for _, port in reachable(pid)}) == 1
    jobs = [job for job, command in marked(mark).items() if any(name in command for name in JOBS)]
    assert jobs
    assert all(len({port for _, port in reachable(job)}) <= 1 for job in jobs)  # where the scheduler reaches each
    cases = [case for case, command in marked(mark).items() if "engines.worker" in command]
    assert not [address for case in cases for address in listening(case)]


@pytest.mark.slow
@pytest.mark.parametrize("running", [True], indirect=True)
def test_a_dashboard_where_it_was_asked_for(running: tuple[int, dict[str, str]], free_port: int) -> None:
    pid, _ = running
    others = [(host, port) for host, port in listening(pid) if (host, port) not in reachable(pid)]
    assert others == [("127.0.0.1", free_port)]


@pytest.mark.parametrize("engine", ["serial", "local", "dask", "auto"])
def test_a_dashboard_that_no_engine_has(engine: str) -> None:
    with pytest.raises(ConfigurationError, match="--dashboard needs --engine slurm"):
        choose_engine(engine, dashboard="127.0.0.1:8787")


@pytest.mark.parametrize("address", ["8787", ":8787", "127.0.0.1:", "127.0.0.1:x", "127.0.0.1:99999", "192.0.2.1:8787"])
def test_a_dashboard_that_cannot_be_opened(address: str) -> None:
    with pytest.raises(ConfigurationError, match="cannot be opened"):
        choose_engine("slurm", dashboard=address)


def test_a_port_that_is_taken(free_port: int) -> None:
    with socket.create_server(("127.0.0.1", free_port)), pytest.raises(ConfigurationError, match="in use"):
        choose_engine("slurm", dashboard=f"127.0.0.1:{free_port}")


def _certificate(folder: Path) -> tuple[Path, Path]:
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("no openssl here to make a certificate")
    key, certificate = folder / "key.pem", folder / "certificate.pem"
    subprocess.run(
        [openssl, "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "1", "-subj", "/CN=localhost",
         "-keyout", str(key), "-out", str(certificate)],
        check=True, capture_output=True,
    )  # fmt: skip
    return key, certificate


def test_an_encrypted_scheduler(tmp_path: Path) -> None:
    """As the guide describes it: Dask's own configuration names the files, and nothing else is accepted."""
    pytest.importorskip("distributed")
    import dask

    key, certificate = _certificate(tmp_path)
    roles = {role: {"key": str(key), "cert": str(certificate)} for role in ("scheduler", "worker", "client")}
    comm = {"default-scheme": "tls", "require-encryption": True, "tls": {"ca-file": str(certificate), **roles}}
    (tmp_path / "dask.yaml").write_text(dask.config.yaml.safe_dump({"distributed": {"comm": comm}}))
    flat = {f"distributed.comm.tls.{role}": files for role, files in roles.items()}
    flat |= {f"distributed.comm.{name}": comm[name] for name in ("default-scheme", "require-encryption")}
    with dask.config.set(flat | {"distributed.comm.tls.ca-file": str(certificate)}):
        environment = {"DASK_CONFIG": str(tmp_path)}
        with running_scheduler(tmp_path, environment=environment, scheduler_environment=environment) as scheduler:
            assert scheduler.address.startswith("tls://")
            found = run_campaign(small(), tmp_path / "run", engine=choose_engine("dask", address=scheduler.address))
            assert (found.done, found.failed) == (6, ())
    run_campaign(small(), tmp_path / "local", engine=choose_engine("local", jobs=2))
    assert content(tmp_path / "run") == content(tmp_path / "local")
