"""Command ``srbval doctor``: state of the installation, compilation of all kernels, cache, JSON Schemas."""

import argparse
import os
import platform
from importlib import metadata
from pathlib import Path
from typing import Any

from srbval import __version__
from srbval.cli.output import print_result, write_text
from srbval.processes.machine import usable_cores
from srbval.progress import ProgressDisplay
from srbval.progress.tables import text_table
from srbval.storage import installation
from srbval.storage.content_store import LIMIT_BYTES

REQUIRED = ("numpy", "scipy", "numba", "pandas", "PyWavelets", "h5py", "matplotlib", "jinja2", "pooch",
            "filelock", "platformdirs", "threadpoolctl")  # fmt: skip
OPTIONAL = ("typst", "soundfile", "npTDMS", "pyuff", "pyarrow", "openpyxl", "shtab", "distributed", "sphinx", "pytest")
MEGABYTE = 1e6  # [bytes]


def run_doctor_command(options: argparse.Namespace) -> int:
    """Check the installation; on request compile all kernels or clear the cache. Exit code 1 for problems."""
    cleared = None if options.clear_cache is None else installation.clear_cache(*options.clear_cache)
    warmed = compile_all_kernels() if options.warm else {}
    found = doctor()
    problems = found["problems"]
    schemas = sorted((installation.package_folder() / "schemas").iterdir()) if options.schemas else []
    written = [Path(options.schemas) / schema.name for schema in schemas]
    for path, schema in zip(written, schemas, strict=True):
        write_text(path, schema.read_text(encoding="utf-8"))

    def show() -> None:
        print(text_table(("item", "value"), list(found["facts"].items())))
        rows = [
            (use["kind"], use["files"], f"{use['size_bytes'] / MEGABYTE:.1f}", use["folder"]) for use in found["cache"]
        ]
        print("\n" + text_table(("cache", "files", "MB", "folder"), rows))
        if found["cache"]:
            limit = f"above {LIMIT_BYTES / MEGABYTE:,.0f} MB the least recently used files are removed"
            known = f"All content can be computed again. {installation.SCENE_RESULTS}: {limit}"
            print(f"{known}. To delete: srbval doctor --clear-cache KIND")
        for use in cleared or ():
            print(f"deleted: {use['folder']}, {use['files']} files, {use['size_bytes'] / MEGABYTE:.1f} MB")
        if warmed:
            print(f"compiled: {', '.join(warmed['compiled']) or 'nothing, all kernels were compiled already'}")
        print("\n".join(f"written: {path}" for path in written))
        print("\n" + ("\n".join(f"problem: {p}" for p in problems) or "no problems found"))

    status = "problems" if problems else "ok"
    result = found | {"cleared": cleared, "schemas": written} | warmed
    return print_result(options, result, show, status=status, code=1 if problems else 0)


def compile_all_kernels() -> dict[str, Any]:
    """Compile all numerical kernels not yet in the cache; return their names (`compiled`) and the time (`seconds`)."""
    from srbval.models.jit import missing_kernels
    from srbval.models.simulate import compile_for, scenes_of_all_kernels

    scenes = scenes_of_all_kernels()
    before = missing_kernels(*scenes)
    with ProgressDisplay() as progress:
        seconds = compile_for(*scenes, progress=progress)
    left = missing_kernels(*scenes)
    return {"compiled": [kernel for kernel in before if kernel not in left], "seconds": seconds}


def doctor() -> dict[str, Any]:
    """Check this installation: returns `ok`, `problems`, `facts` (versions, folders) and the size of the `cache`."""
    facts: dict[str, Any] = {"srbval": __version__, "python": platform.python_version()}
    facts |= {"machine": platform.machine(), "cores": usable_cores()}
    facts |= {name: _version(name) for name in REQUIRED}
    missing = {name: f"not installed: {installation.pip_command(name)}" for name in (*REQUIRED, *OPTIONAL)}
    problems = [f"{name} is {missing[name]}" for name in REQUIRED if facts[name] is None]
    facts |= {name: _version(name) or missing[name] for name in OPTIONAL}
    kernels = installation.cache_folder(installation.KERNELS)
    existing = next(folder for folder in (kernels, *kernels.parents) if folder.exists())
    if not os.access(existing, os.W_OK):
        problems.append(f"compiled kernels cannot be stored: {existing} is not writable; set NUMBA_CACHE_DIR")
    recordings = os.environ.get("SRBVAL_RECORDINGS")
    if recordings and not Path(recordings).is_dir():
        problems.append(f"SRBVAL_RECORDINGS names {recordings}, which is not a folder")
    facts |= {
        "kernel cache": str(kernels),
        "known data sets": str(installation.shipped_folder("data_manifest")),
        "SRBVAL_RECORDINGS": recordings or "not set",
        "numba threads": os.environ.get("NUMBA_NUM_THREADS", "default (kernels use one)"),
    }
    return {"ok": not problems, "problems": problems, "facts": facts, "cache": installation.cache_use()}


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None
