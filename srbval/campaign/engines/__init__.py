"""Where cases run: engines by name."""

import socket
from importlib import util

from srbval.campaign.engines.local import Engine, LocalProcesses
from srbval.errors import ConfigurationError
from srbval.processes.machine import usable_cores
from srbval.storage.installation import MissingLibraryError

AUTO, SERIAL, LOCAL, DASK, SLURM = "auto", "serial", "local", "dask", "slurm"
NAMES = (AUTO, SERIAL, LOCAL, DASK, SLURM)


def choose_engine(
    name: str = AUTO,
    *,
    jobs: int | None = None,
    address: str | None = None,
    wait_s: float | None = None,
    dashboard: str | None = None,
) -> Engine:
    """The engine of that name.

    ``serial`` is one worker process of this machine, ``local`` are `jobs` of them, ``dask`` is the cluster of the
    scheduler at `address`, ``slurm`` jobs of its own. ``auto`` and ``dask`` are ``local`` where no `address` is given:
    a Dask cluster on one machine would do the same, later.

    `jobs` workers, by default one per usable core; `wait_s` is how long a cluster may have no worker [s], by default
    two minutes, an hour with ``slurm``; `dashboard` is where ``slurm`` serves Dask's web pages, ``HOST:PORT``, by
    default nowhere. Raises `ConfigurationError` for an unknown name, options that do not fit it, or missing packages.
    """
    if name not in NAMES:
        raise ConfigurationError(f"engine {name!r} is not known. Known: {', '.join(NAMES)}.")
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"--jobs {jobs} must be at least 1.")
    if address is not None and name not in (AUTO, DASK):
        raise ConfigurationError(f"a scheduler's address needs --engine dask, not {name!r}.")
    if dashboard is not None and name != SLURM:
        raise ConfigurationError(
            f"--dashboard needs --engine slurm, not {name!r}: no other engine has one of its own. That of a running "
            "scheduler is opened where this is started: dask scheduler --dashboard-address HOST:PORT."
        )
    if dashboard is not None:
        _check_dashboard(dashboard)
    workers = jobs or usable_cores()
    if address is not None or name == SLURM:
        engine, package = (SLURM, "dask_jobqueue") if address is None else (DASK, "distributed")
        if util.find_spec(package) is None:
            raise MissingLibraryError(f"engine {engine!r}", "dask[distributed]", "dask-jobqueue")
        from srbval.campaign.engines.dask_cluster import cluster_at, slurm_cluster

        waiting = {} if wait_s is None else {"wait_s": wait_s}
        if address is not None:
            return cluster_at(address, **waiting)
        return slurm_cluster(workers, dashboard=dashboard, **waiting)
    return LocalProcesses(1, name=SERIAL) if name == SERIAL else LocalProcesses(workers)


def _check_dashboard(address: str) -> None:
    host, _, port = address.rpartition(":")
    try:
        if not (host and 0 < int(port) < 65536):
            raise ValueError("no host, or no port")
        socket.create_server((host, int(port))).close()  # Dask would take another port
    except (OSError, ValueError) as error:
        raise ConfigurationError(
            f"--dashboard {address!r} cannot be opened ({error}). Give HOST:PORT of this machine, like 127.0.0.1:8787."
        ) from None
