"""Names and source files of models from outside, and the hash of the sources, which identifies stored results.

A scene's `model` may be ``FILE.py:NAME`` or ``package.module:NAME`` (a function, see `signals`), ``FILE.fmu``,
``command TEXT`` (a program), or an entry point of the group ``srbval.models`` of an installed package.
"""

import ast
import hashlib
import importlib.util
import shlex
import shutil
from functools import cache
from pathlib import Path

from srbval.errors import ConfigurationError, DataError

COMMAND, FMU, SOLVERS_VARIABLE = "command ", ".fmu", "SOLVERS"
OWN_SOLVER = "own"  # name of the solver of a model that offers no choice


def is_outside(name: str) -> bool:
    """True if `name` is a model from outside; raises `ConfigurationError` for ``FILE.py`` without a function."""
    if name.endswith(".py"):
        raise ConfigurationError(f"model {name!r}: name its function too, for example {name}:simulate.")
    return name.startswith(COMMAND) or name.endswith(FMU) or ":" in name or name in entry_points()


@cache
def entry_points() -> dict[str, str]:
    """Models of installed packages: ``package.module:NAME`` by name of the entry point."""
    from importlib import metadata  # slow import

    return {point.name: point.value for point in metadata.entry_points(group="srbval.models")}


def content_of(name: str) -> str:
    """Text that identifies a model: name without folder, hash of its source files; `DataError` if one is missing."""
    digest = hashlib.sha256()
    for path in sources_of_model(name):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return f"{name if name.startswith(COMMAND) else Path(name).name} {digest.hexdigest()[:32]}"


def solvers_of(name: str) -> tuple[str, ...]:
    """Solvers that a Python model lists in its file as a literal ``SOLVERS = (...)``; the file is not executed."""
    try:
        tree = ast.parse(sources_of_model(name)[0].read_bytes())
        assigned = [node for node in tree.body if isinstance(node, ast.Assign)]
        return next(tuple(ast.literal_eval(n.value)) for n in assigned if ast.unparse(n.targets[0]) == SOLVERS_VARIABLE)
    except (IndexError, StopIteration, SyntaxError, TypeError, ValueError):
        return ()


def sources_of_model(name: str) -> list[Path]:
    """Source files of a model from outside, main file first.

    They are a Python file and the files in its folder that it imports, all Python files of a package, an FMU and its
    TOML file, or the files that a command names.
    """
    place = entry_points().get(name, name)
    if place.startswith(COMMAND):
        program, *words = shlex.split(place.removeprefix(COMMAND)) or [""]
        return [path for word in (shutil.which(program) or program, *words) if (path := Path(word)).is_file()]
    own = Path(place if place.endswith(FMU) else place.rpartition(":")[0])
    if own.suffix not in (".py", FMU):
        return _of_module(str(own))
    if not own.is_file():
        raise DataError(f"{own}: no such file. A model from outside is FILE.py:NAME, package.module:NAME or FILE.fmu.")
    if own.suffix == FMU:
        return [own, *(path for path in [own.with_suffix(".toml")] if path.is_file())]
    from modulefinder import ModuleFinder  # slow import

    finder = ModuleFinder(path=[str(own.parent)])
    try:
        finder.run_script(str(own))  # follows imports without executing them
    except (SyntaxError, ValueError):  # reported by the run
        return [own]
    files = [getattr(module, "__file__", None) for module in finder.modules.values()]
    beside = {Path(file) for file in files if file}
    return [own, *sorted(beside - {own})]


def _of_module(module: str) -> list[Path]:
    """Python files of the package that contains a module, the module first; no code of the package is executed."""
    package, *inner = module.split(".")
    spec = importlib.util.find_spec(package) if package else None
    if spec is None or spec.origin is None:
        raise DataError(f"model {module!r}: no Python package {package!r} is installed here, and no such file exists.")
    folders = [Path(folder) for folder in spec.submodule_search_locations or ()]
    own = [folder.joinpath(*inner).with_suffix(".py") for folder in folders if inner] or [Path(spec.origin)]
    rest = sorted(file for folder in folders for file in folder.rglob("*.py"))
    return [file for file in (*own, *rest) if file.is_file()]
