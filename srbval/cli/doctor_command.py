"""``srbval doctor``: versions, threads, caches, extras."""

from __future__ import annotations

import argparse
import os
import platform
from importlib import metadata, util
from typing import Any

from srbval import __version__
from srbval.cli.output import print_json, print_table
from srbval.recordings.datasets.description import data_manifest_folder

REQUIRED = (
    "numpy",
    "scipy",
    "numba",
    "pandas",
    "PyWavelets",
    "h5py",
    "matplotlib",
    "jinja2",
    "rich",
    "pooch",
)
EXTRAS = {"typst": "pdf", "distributed": "cluster", "sphinx": "docs", "pytest": "test"}


def run(options: argparse.Namespace) -> int:
    """Check the installation; exit code 0 when sound, 1 with problems."""
    problems: list[str] = []
    facts: dict[str, Any] = {
        "srbval": __version__,
        "python": platform.python_version(),
        "machine": platform.machine(),
        "cores": os.cpu_count(),
    }
    for name in REQUIRED:
        facts[name] = _version(name)
        if facts[name] is None:
            problems.append(f"{name} is not installed: pip install {name}")
    for name, extra in EXTRAS.items():
        facts[name] = _version(name) if util.find_spec(name) else f'not installed (pip install "srbval[{extra}]")'
    facts |= _places(problems)
    if options.json:
        print_json(
            {"ok": not problems, "problems": problems, "facts": facts},
            status="ok" if not problems else "problems",
        )
    else:
        print_table(("what", "is"), list(facts.items()))
        print("\n" + ("no problems found" if not problems else "\n".join(f"problem: {p}" for p in problems)))
    return 1 if problems else 0


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _places(problems: list[str]) -> dict[str, str]:
    from srbval.models.kernel_cache import kernel_cache_folder

    store = kernel_cache_folder()
    parent = next(p for p in (store, *store.parents) if p.exists())
    if not os.access(parent, os.W_OK):
        problems.append(f"compiled kernels cannot be kept: {parent} is not writable; set NUMBA_CACHE_DIR")
    recordings = os.environ.get("SRBVAL_RECORDINGS")
    if recordings and not os.path.isdir(recordings):
        problems.append(f"SRBVAL_RECORDINGS names {recordings}, which is no folder")
    folder = data_manifest_folder()
    return {
        "kernel store": str(store),
        "known data sets": str(folder),
        "SRBVAL_RECORDINGS": recordings or "not set",
        "numba threads": os.environ.get("NUMBA_NUM_THREADS", "default (kernels use one)"),
    }
