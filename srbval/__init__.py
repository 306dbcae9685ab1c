"""Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.

Names are loaded when they are first used, so that ``import srbval`` is fast::

    import srbval

    scene = srbval.paper_scene(defect="outer", duration="2 s")  # inputs of Giraudo et al. (2025)
    run = srbval.simulate(scene)
    analysis = srbval.analyse(run)
"""

import sys

__version__ = "0.2.0"
_HOMES: dict[str, tuple[str, str]] = {}


def _homes() -> dict[str, tuple[str, str]]:
    """Map each public name of `srbval` to the module that defines it and its name there, as in ``__init__.pyi``."""
    if not _HOMES:
        import ast
        from pathlib import Path

        tree = ast.parse(Path(__file__).with_suffix(".pyi").read_text(encoding="utf-8"))
        imports = [node for node in tree.body if isinstance(node, ast.ImportFrom)]
        _HOMES.update({one.asname or one.name: (str(node.module), one.name) for node in imports for one in node.names})
    return _HOMES


def __getattr__(name: str) -> object:
    if name == "__all__":
        return __dir__()
    if name.startswith("__") or name not in (homes := _homes()):  # Python looks up such names at each start
        raise AttributeError(f"module 'srbval' has no attribute {name!r}")
    import importlib

    module, attribute = homes[name]
    found = getattr(importlib.import_module(module), attribute)
    if type(found) is not type(__dir__):
        return found
    from srbval.bridges import with_keyword_errors

    return with_keyword_errors(name, found)


class _Package(type(sys)):  # type: ignore[misc]  # class of modules
    """Class of the module `srbval`; keeps its functions `plan` and `report` when sub-packages so named are imported."""

    def __setattr__(self, name: str, value: object) -> None:
        if name not in ("plan", "report"):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package


def __dir__() -> list[str]:
    return ["__version__", *sorted(_homes())]
