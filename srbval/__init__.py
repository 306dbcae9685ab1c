"""Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.

Names are loaded when they are first used, so that ``import srbval`` is fast::

    import srbval

    run = srbval.simulate(srbval.paper_scene(defect={"kind": "outer"}, duration="2 s"))
    analysis = srbval.analyse(srbval.recording_from_run(run), bearing=srbval.load_bearing("skf-22240"))
"""

import ast
import importlib
from pathlib import Path
from typing import Any

__version__ = "0.2.0"

# Module and original name of each public name, read from the stub that type checkers use.
_HOME = {
    alias.asname or alias.name: (str(node.module), alias.name)
    for node in ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8")).body
    if isinstance(node, ast.ImportFrom)
    for alias in node.names
}
__all__ = ["__version__", *sorted(_HOME)]


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'srbval' has no attribute {name!r}")
    module, attribute = _HOME[name]
    return getattr(importlib.import_module(module), attribute)


def __dir__() -> list[str]:
    return sorted(__all__)
