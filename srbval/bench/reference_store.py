"""Reference results on disk: one small JSON file each, named by everything they depend on."""

from __future__ import annotations

import hashlib
import json
from functools import cache
from pathlib import Path
from typing import Any

import srbval
from srbval.bearing import load_bearing
from srbval.models.kernel_cache import kernel_cache_folder
from srbval.models.run_file import scene_dict
from srbval.scene import Scene
from srbval.storage.strict_json import write_json

MEASURED_BY = ("bearing/*.py", "signal/*.py", "validation/pipeline.py", "recordings/from_run.py", "bench/measures.py")


def reference_folder() -> Path:
    """Where references are kept: below the user's cache."""
    import platformdirs

    return Path(platformdirs.user_cache_dir("srbval")) / "bench-references"


def reference_key(scene: Scene) -> str:
    """Name of a scene's result with exactly this version of the model and of what measures its runs."""
    content = json.dumps(scene_dict(scene), sort_keys=True) + repr(load_bearing(scene.bearing))
    version = f"{kernel_cache_folder().name} {_measuring()}"
    return hashlib.sha256(f"{version} {content}".encode()).hexdigest()[:24]


@cache
def _measuring() -> str:
    package = Path(srbval.__file__).parent
    digest = hashlib.sha256()
    for pattern in MEASURED_BY:
        for source in sorted(package.glob(pattern)):
            digest.update(source.read_bytes())
    return digest.hexdigest()


def load_reference(folder: Path, key: str) -> dict[str, Any] | None:
    """The stored result; None where there is none or it cannot be read."""
    try:
        table: dict[str, Any] = json.loads((folder / f"{key}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return table


def save_reference(folder: Path, key: str, table: dict[str, Any]) -> None:
    """Keep a result; `DataError` where the folder cannot be written."""
    write_json(folder / f"{key}.json", table)
