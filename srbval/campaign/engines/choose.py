"""Engines by name."""

from __future__ import annotations

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
    """The engine of that name: ``auto`` is Dask on this machine where it is installed, else processes.

    `jobs` workers, by default one a usable core; `address` of a Dask scheduler that is there already, with ``auto`` or
    ``dask``; `wait_s` for a worker of a Dask cluster that has none [s], by default two minutes, an hour with ``slurm``.
    Raises `ConfigurationError` for an unknown name, or one whose packages are missing.
    """
    if name not in NAMES:
        raise ConfigurationError(f"engine {name!r} is not known. Known: {', '.join(NAMES)}.")
    if jobs is not None and jobs < 1:
        raise ConfigurationError(f"--jobs {jobs} must be at least 1.")
    if address is not None and name not in (AUTO, DASK):
        raise ConfigurationError(f"a scheduler's address needs --engine dask, not {name!r}.")
    if name == AUTO:
        name = DASK if address is not None or _installed("distributed") else LOCAL
    workers = jobs or usable_cores()
    if name == SERIAL:
        from srbval.campaign.engines.serial import Serial

        return Serial()
    if name == LOCAL:
        from srbval.campaign.engines.processes import LocalProcesses

        return LocalProcesses(workers)
    needed = "dask_jobqueue" if name == SLURM else "distributed"
    if not _installed(needed):
        raise ConfigurationError(f"engine {name!r} needs {needed.replace('_', '-')}: {INSTALL}")
    from srbval.campaign.engines import dask_engine

    waiting = {} if wait_s is None else {"wait_s": wait_s}
    if name == SLURM:
        return dask_engine.slurm(workers, **waiting)
    if address is not None:
        return dask_engine.existing(address, **waiting)
    return dask_engine.embedded(workers, **waiting)


def _installed(package: str) -> bool:
    return util.find_spec(package) is not None
