"""The version of a result: a hash of every source file that the code which computes it depends on.

The files follow from the imports, from module to module within the package, those within functions included. So
nobody keeps a list of them, and a result is out of date exactly when something changed that may have changed it.
"""

import ast
import hashlib
import itertools
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from srbval.storage.own_package import package_folder

PACKAGE = package_folder()

# Import statements are found by their first word and parsed alone: parsing whole files would take ten times as long.
STATEMENT = re.compile(r"^[ \t]*(?:from|import)[ \t][^\n(]*(?:\([^)]*\))?", re.MULTILINE)
PLACE = re.compile(r"""["']([\w.]+):\w+["']""")  # "module:name", of what is imported when it is first used
DATA_FILE = re.compile(r"""["']([\w-]+\.(?:toml|json|csv))["']""")


@cache
def content_version(*modules: str, package: Path = PACKAGE) -> str:
    """Hash of all sources that `modules` depend on, 16 hexadecimal digits; names are dotted, the package's first."""
    digest = hashlib.sha256()
    for source in sorted(sources_of(*modules, package=package)):
        digest.update(source.relative_to(package).as_posix().encode() + b"\0" + source.read_bytes())
    return digest.hexdigest()[:16]


def sources_of(*modules: str, package: Path = PACKAGE) -> set[Path]:
    """Source files of `modules` and of everything they import within `package`, directly or not.

    Data files beside a module count where it names them in quotes. Not the package's own ``__init__``: it only lends
    the package's names. Raises `ModuleNotFoundError` for a module that does not exist.
    """
    known = _modules(package)
    missing = [module for module in modules if module not in known]
    if missing:
        raise ModuleNotFoundError(f"no module {missing[0]!r} in {package}")
    found: set[Path] = set()
    waiting = [file for module in modules for file in _run_by(module, known)]
    while waiting:
        source = waiting.pop()
        if source not in found:
            found.add(source)
            waiting += _used_by(source, known) if source.suffix == ".py" else ()
    return found


def _modules(package: Path) -> dict[str, Path]:
    """File of every module in the package, by dotted name; of a package within it, the ``__init__``."""
    found = {}
    for source in package.rglob("*.py"):
        parts = source.relative_to(package.parent).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = source
    found.pop(package.name, None)
    return found


def _run_by(name: str, known: dict[str, Path]) -> list[Path]:
    """Files that importing a dotted name runs: the packages on the way, the module; the rest is a name within it."""
    return [known[part] for part in itertools.accumulate(name.split("."), "{}.{}".format) if part in known]


def _used_by(source: Path, known: dict[str, Path]) -> list[Path]:
    """Files that a module uses: the modules it imports, by a statement or as "module:name"; data files beside it."""
    text = source.read_text(encoding="utf-8")
    files = [file for name in {*PLACE.findall(text), *_imported(text)} for file in _run_by(name, known)]
    return files + [path for name in DATA_FILE.findall(text) if (path := source.with_name(name)).is_file()]


def _imported(text: str) -> Iterator[str]:
    """Dotted names that the import statements of a source name; a line of prose that begins alike names nothing."""
    for statement in STATEMENT.findall(text):
        try:
            node = ast.parse(statement.strip()).body[0]
        except SyntaxError:
            continue
        if isinstance(node, ast.ImportFrom):
            yield from (f"{node.module}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
