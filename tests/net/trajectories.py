"""Item `trajectories`: runs of all models and solvers, with a hash of every dataset of the run file."""

import hashlib
import json
import shlex
import tomllib
from pathlib import Path
from typing import Any

import h5py

from tests.net.child import Checkout, with_json

SCENES = Path(__file__).with_name("scenes.toml")


def record(checkout: Checkout) -> dict[str, Any]:
    """Output and run file of every scene in ``scenes.toml``; where a run fails there is no file, which is seen too."""
    found = {}
    for name, case in tomllib.loads(SCENES.read_text(encoding="utf-8")).items():
        scene, run = checkout.scratch / f"{name}.toml", checkout.scratch / f"{name}.h5"
        scene.write_text(case.get("scene", ""), encoding="utf-8")
        words = shlex.split(case["simulate"].replace("SCENE", scene.name))
        found[name] = checkout.run(*with_json(["simulate", *words, "-o", run.name]))
        found[name]["file"] = _content(checkout, run) if run.exists() else None
        run.unlink(missing_ok=True)
    return found


def _content(checkout: Checkout, run: Path) -> dict[str, Any]:
    """Attributes of a run file, and of each dataset its type, shape, units and the hash of its numbers."""
    with h5py.File(run) as file:
        attributes = {key: _attribute(value) for key, value in file.attrs.items()}
        datasets = {
            name: {
                "type": str(data.dtype),
                "shape": list(data.shape),
                "units": _attribute(data.attrs.get("units", "")),
                "sha256": hashlib.sha256(data[()].tobytes()).hexdigest(),
            }
            for name, data in sorted(file.items())
        }
    return {"attributes": checkout.comparable(attributes), "datasets": datasets}


def _attribute(value: Any) -> Any:
    """An attribute as plain values; one that holds JSON as what it holds."""
    plain = value.decode() if isinstance(value, bytes) else value.tolist() if hasattr(value, "tolist") else value
    try:
        return json.loads(plain) if isinstance(plain, str) else plain
    except ValueError:
        return plain
