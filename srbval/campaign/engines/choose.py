"""Engines by name."""

from importlib import util

from srbval.bench.machine import usable_cores
from srbval.campaign.engines.engine import Engine
from srbval.errors import ConfigurationError

AUTO, SERIAL, LOCAL, DASK, SLURM = "auto", "serial", "local", "dask", "slurm"
NAMES = (AUTO, SERIAL, LOCAL, DASK, SLURM)
INSTALL = 'pip install "srbval[cluster]"'


def choose_engine(
    name: str = AUTO, *, jobs: int | None = None, address: str | None = None, wait_s: float | None = None
) -> Engine:
    """The engine of that name.

    ``serial`` runs in this process, ``local`` in processes of this machine, ``dask`` on the cluster of the scheduler at
    `address`, ``slurm`` on jobs of its own. ``auto`` and ``dask`` are ``local`` where no `address` is given: a Dask
    cluster on one machine would do the same, later.

    `jobs` workers, by default one per usable core; `wait_s` is how long a cluster may have no worker [s], by default
    two minutes, an hour with ``slurm``. Raises `ConfigurationError` for an unknown name, or missing packages.
    """
    if name not in NAMES:
        raise ConfigurationError(f"engine {name!r} is not known. Known: {', '.join(NAMES)}.")
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"--jobs {jobs} must be at least 1.")
    if address is not None and name not in (AUTO, DASK):
        raise ConfigurationError(f"a scheduler's address needs --engine dask, not {name!r}.")
    workers = jobs or usable_cores()
    waiting = {} if wait_s is None else {"wait_s": wait_s}
    if name == SERIAL:
        from srbval.campaign.engines.local import Serial

        return Serial()
    if address is not None:
        _require("distributed", DASK)
        from srbval.campaign.engines.dask_cluster import cluster_at

        return cluster_at(address, **waiting)
    if name == SLURM:
        _require("dask_jobqueue", SLURM)
        from srbval.campaign.engines.dask_cluster import slurm_cluster

        return slurm_cluster(workers, **waiting)
    from srbval.campaign.engines.local import LocalProcesses

    return LocalProcesses(workers)


def _require(package: str, engine: str) -> None:
    if util.find_spec(package) is None:
        raise ConfigurationError(f"engine {engine!r} needs {package.replace('_', '-')}: {INSTALL}")
