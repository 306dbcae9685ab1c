"""Item `analyse`: ``srbval analyse`` of every recording, with the options that its data set needs."""

import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from tests.net.child import Checkout, recordings_folder, with_json

CASES = Path(__file__).with_name("recordings.toml")


def record(checkout: Checkout) -> dict[str, Any]:
    """Default analysis of every file, what it refuses included; with ``recordings.toml``'s options; the plain text."""
    return {name: checkout.run(*words) for name, words in _commands(recordings_folder())}


def _commands(folder: Path) -> Iterator[tuple[str, list[str]]]:
    sets = tomllib.loads(CASES.read_text(encoding="utf-8"))
    for file in sorted(path for path in folder.rglob("*") if path.is_file() and path.name != "manifest.json"):
        name = file.relative_to(folder).as_posix()
        known = sets.get(name.split("/")[0], {})
        needed = known.get("options", [])
        if needed:  # refused without them
            yield f"{name} default", with_json(["analyse", str(file)])
        yield f"{name} options", with_json(["analyse", str(file), *needed])
        if file.stem in known.get("auto_band", []):
            yield f"{name} auto-band", with_json(["analyse", str(file), *needed, "--auto-band"])
            yield f"{name} text", ["analyse", str(file), *needed]
        if file.stem in known.get("healthy", {}):
            healthy = file.with_name(known["healthy"][file.stem])
            yield f"{name} healthy", with_json(["analyse", str(file), *needed, "--healthy", str(healthy)])
