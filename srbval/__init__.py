"""Validate and benchmark simulated spherical-roller-bearing vibration against measured recordings.

Names are loaded when they are first used, so that ``import srbval`` is fast::

    import srbval

    run = srbval.simulate(srbval.paper_scene(defect={"kind": "outer"}, duration="2 s"))
    analysis = srbval.analyse(srbval.recording_from_run(run), bearing=srbval.load_bearing("skf-22240"))
"""

__version__ = "0.2.0"
_HOMES: dict[str, tuple[str, str]] = {}


def _homes() -> dict[str, tuple[str, str]]:
    """Module and original name of each public name, read once from the stub that type checkers use."""
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
    if name.startswith("__") or name not in (homes := _homes()):  # those of Python itself are asked for at each start
        raise AttributeError(f"module 'srbval' has no attribute {name!r}")
    import importlib

    module, attribute = homes[name]
    return getattr(importlib.import_module(module), attribute)


def __dir__() -> list[str]:
    return ["__version__", *sorted(_homes())]
