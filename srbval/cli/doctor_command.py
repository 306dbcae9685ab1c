"""``srbval doctor``: versions, threads, caches, extras; and the way to clear the cache."""

import argparse
import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.cli.output import print_json, print_table
from srbval.storage.cache import KERNELS, cache_folder, cache_use, clear_cache
from srbval.storage.installation import shipped_folder

REQUIRED = ("numpy", "scipy", "numba", "pandas", "PyWavelets", "h5py", "matplotlib", "jinja2", "rich", "pooch",
            "filelock", "platformdirs", "threadpoolctl")  # fmt: skip
EXTRAS = {
    "typst": "pdf", "soundfile": "formats", "npTDMS": "formats", "pyuff": "formats", "pyarrow": "tables",
    "shtab": "completion", "distributed": "cluster", "sphinx": "docs", "pytest": "test",
}  # fmt: skip
MEGABYTE = 1e6  # [bytes]


def run(options: argparse.Namespace) -> int:
    """Check the installation, and clear the cache where asked; exit code 0 when sound, 1 with problems."""
    cleared = None if options.clear_cache is None else clear_cache(*options.clear_cache)
    found = doctor()
    problems, facts, cache = found["problems"], found["facts"], found["cache"]
    if options.json:
        print_json(found | {"cleared": cleared}, status="problems" if problems else "ok")
    else:
        print_table(("what", "is"), list(facts.items()))
        print()
        rows = [(use.kind, use.files, f"{use.size_bytes / MEGABYTE:.1f}", use.folder) for use in cache]
        print_table(("cache", "files", "MB", "folder"), rows)
        for use in cleared or ():
            left = f"; {use.left} files that are not srbval's were left" if use.left else ""
            print(f"deleted: {use.folder}, {use.files} files, {use.size_bytes / MEGABYTE:.1f} MB{left}")
        print("\n" + ("\n".join(f"problem: {p}" for p in problems) or "no problems found"))
    return 1 if problems else 0


def doctor() -> dict[str, Any]:
    """Whether this installation is sound (`ok`), its `problems`, `facts` and the use of its `cache`."""
    problems: list[str] = []
    facts = _versions(problems) | _places(problems)
    return {"ok": not problems, "problems": problems, "facts": facts, "cache": cache_use()}


def _versions(problems: list[str]) -> dict[str, Any]:
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
        facts[name] = _version(name) or f'not installed (pip install "srbval[{extra}]")'
    return facts


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _places(problems: list[str]) -> dict[str, str]:
    kernels = cache_folder(KERNELS)
    existing = next(folder for folder in (kernels, *kernels.parents) if folder.exists())
    if not os.access(existing, os.W_OK):
        problems.append(f"compiled kernels cannot be stored: {existing} is not writable; set NUMBA_CACHE_DIR")
    recordings = os.environ.get("SRBVAL_RECORDINGS")
    if recordings and not Path(recordings).is_dir():
        problems.append(f"SRBVAL_RECORDINGS names {recordings}, which is not a folder")
    return {
        "kernel cache": str(kernels),
        "known data sets": str(shipped_folder("data_manifest")),
        "SRBVAL_RECORDINGS": recordings or "not set",
        "numba threads": os.environ.get("NUMBA_NUM_THREADS", "default (kernels use one)"),
    }
